#!/usr/bin/env python3
"""Runs blinn's farm jobs with openjd-cli and with Slurm on one node.

    farm.py BLINN [openjd|slurm]

Each engine renders a turntable of twelve frames. A task is killed halfway; Slurm requeues it, and the Open Job
Description job is run again. The result equals that of one process on this machine, byte for byte. Slurm and munge run
as this user in a folder and on ports of their own, so an existing cluster or another run of this script is not
affected.
"""
import getpass
import glob
import json
import os
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

from PIL import Image

BLINN = os.path.abspath(sys.argv[1])
MODEL = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "models", "still-life", "still-life.glb")
# A name with special characters of shells and templates.
SCENE = "still life's $(x) {a} \"&\".glb"
COUNT = 12
# Half a second a frame on one thread, two seconds a task: long enough to be killed, even if engines respond late.
LOOK = ["--count", str(COUNT), "--size", "320x180", "-s", "256", "--elevation", "25", "--seed", "3"]
MOVING = "spin of {stem}.apng"
MADE = MOVING.replace("{stem}", SCENE.removesuffix(".glb"))


def run(*command, code=0, **options):
    done = subprocess.run(command, capture_output=True, text=True, **options)
    assert done.returncode == code, f"{shlex.join(command)} ended with {done.returncode}: {done.stdout}{done.stderr}"
    return done.stdout


def until(what, found, seconds=60):
    """Waits until `found` returns a true value."""
    end = time.time() + seconds
    while not (value := found()):
        assert time.time() < end, f"no {what} within {seconds} s"
        time.sleep(0.05)
    return value


def bytes_of(name):
    with open(name, "rb") as file:
        return file.read()


def frames(folder):
    return sorted(glob.glob(os.path.join(glob.escape(folder), "frames-*", "*.png")))


def alive(pid):
    """Returns true if a process exists and is no zombie."""
    try:
        with open(f"/proc/{pid}/stat") as stat:
            return stat.read().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def workers(folder):
    """Returns the processes of BLINN that render to `folder`."""
    found = []
    for entry in glob.glob("/proc/[0-9]*"):
        try:
            words = bytes_of(f"{entry}/cmdline").split(b"\0")
            where = os.readlink(f"{entry}/cwd")
        except OSError:
            continue
        output = next((w[9:].decode() for w in words if w.startswith(b"--output=")), None)
        if words[0] == BLINN.encode() and output and os.path.join(where, output).startswith(folder):
            found.append(int(entry.removeprefix("/proc/")))
    return found


def job(engine, *flags):
    """Makes a folder with a scene and the job that renders it; returns the job's file."""
    os.makedirs(engine)
    shutil.copy(MODEL, os.path.join(engine, SCENE))
    file = "job.json" if engine == "openjd" else "job.sh"
    run(BLINN, "job", engine, "--chunk-size", "5", *flags, "-o", file, "turntable", SCENE, "-o", "out/" + MOVING, *LOOK,
        cwd=engine)
    return file


def local():
    """Renders the same without a farm: the animation file and its frames."""
    os.makedirs("local")
    shutil.copy(MODEL, os.path.join("local", SCENE))
    run(BLINN, "turntable", SCENE, "-o", MOVING, *LOOK, cwd="local")
    run(BLINN, "turntable", SCENE, "-o", "####.png", *LOOK, cwd="local")


def compare(engine, words):
    """The farm's files beside those of one process; `words` are the farm's own, for all frames."""
    out = os.path.join(engine, "out")
    assert bytes_of(os.path.join(out, MADE)) == bytes_of(os.path.join("local", MADE)), "another moving picture"
    made = frames(out)
    assert len(made) == COUNT, made
    # Files say which settings they were made with, and the farm's say more of them.
    whole = os.path.abspath(os.path.join("whole", engine))
    run(BLINN, *[f"--output={whole}/####.png" if w.startswith("--output=") else w for w in words], cwd=engine)
    for file in made:
        name = os.path.basename(file)
        assert bytes_of(file) == bytes_of(os.path.join(whole, name)), f"{file} has other bytes"
        with Image.open(file) as ours, Image.open(os.path.join("local", name)) as theirs:
            assert ours.tobytes() == theirs.tobytes(), f"{file} has other pixels"
    leftovers = [f for f in os.listdir(out) if f not in (MADE, os.path.basename(os.path.dirname(made[0])))]
    assert not leftovers, leftovers


def openjd():
    tool = os.path.join(os.path.dirname(sys.executable), "openjd")
    file = job("openjd", "--target-seconds", "0")
    run(tool, "check", file, cwd="openjd")
    command = [tool, "run", file, "--job-param", f"Blinn={BLINN}"]
    out = os.path.abspath("openjd/out")
    # The arguments of a task, as for one process.
    with open(os.path.join("openjd", file)) as text:
        template = json.load(text)
    words = template["steps"][0]["script"]["actions"]["onRun"]["args"]
    filled = {"Param.Scene": SCENE, "Param.Output": "out", "Task.Param.Frame": f"1-{COUNT}"}
    for name, value in filled.items():
        words = [word.replace("{{%s}}" % name, value) for word in words]

    with open("openjd/first.log", "w") as log:
        first = subprocess.Popen(command, cwd="openjd", stdout=log, stderr=log)
    try:
        until("frames", lambda: len(frames(out)) >= 5)
        for pid in workers(out):
            os.kill(pid, signal.SIGKILL)
        assert first.wait(60) != 0, "the engine did not report the killed task"
    finally:
        first.kill()
    kept = {file: os.stat(file).st_mtime_ns for file in frames(out)}
    assert 5 <= len(kept) < COUNT, kept
    log = run(*command, cwd="openjd")
    for line in ("openjd_progress: 100", "openjd_status: "):
        assert line in log, f"no '{line}': {log}"
    assert all(os.stat(file).st_mtime_ns == at for file, at in kept.items()), "finished frames were rendered again"
    # Killed processes leave partial files.
    for part in glob.glob(os.path.join(glob.escape(out), "**", ".blinn-*.part"), recursive=True):
        os.remove(part)
    compare("openjd", words)
    # A failed task reports why.
    failed = subprocess.run([*command, "-p", "Frames=40-41", "--step", "Frames"], cwd="openjd", capture_output=True, text=True)
    assert failed.returncode != 0 and "the frames are 1 to 12" in failed.stdout + failed.stderr, failed
    print(f"openjd: killed after {len(kept)} of {COUNT} frames, and run again: same bytes")


class Slurm:
    """A cluster of one node, this machine."""

    def __init__(self, folder):
        self.folder = folder
        self.daemons = []
        for name in ("state", "spool"):
            os.makedirs(os.path.join(folder, name))
        at = lambda name: os.path.join(folder, name)
        with open(at("munge.key"), "wb") as key:
            key.write(os.urandom(128))
        os.chmod(at("munge.key"), 0o600)
        # Another process may take these ports before the daemons do: they would exit with an error.
        free = [socket.socket() for _ in range(2)]
        for one in free:
            one.bind(("127.0.0.1", 0))
        ports = [one.getsockname()[1] for one in free]
        for one in free:
            one.close()
        with open(at("slurm.conf"), "w") as conf:
            conf.write(f"""
ClusterName=blinn
SlurmctldHost={socket.gethostname()}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmUser={getpass.getuser()}
SlurmdUser={getpass.getuser()}
AuthType=auth/munge
CryptoType=crypto/munge
# A requeued task waits until its old credentials expire.
AuthInfo=socket={at("munge.socket")},cred_expire=5
StateSaveLocation={at("state")}
SlurmdSpoolDir={at("spool")}
SlurmctldPidFile={at("slurmctld.pid")}
SlurmdPidFile={at("slurmd.pid")}
SlurmctldLogFile={at("slurmctld.log")}
SlurmdLogFile={at("slurmd.log")}
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=2,bf_interval=2,batch_sched_delay=0
SlurmdParameters=config_overrides
# A task that has not exited two seconds after SIGTERM is killed.
KillWait=2
JobFileAppend=1
ReturnToService=2
NodeName=farm NodeAddr=127.0.0.1 NodeHostname={socket.gethostname()} CPUs=2
PartitionName=all Nodes=farm Default=YES State=UP
""")
        os.environ["SLURM_CONF"] = at("slurm.conf")
        self.start("munged", "--foreground", "--force", f"--key-file={at('munge.key')}", f"--socket={at('munge.socket')}",
                   f"--pid-file={at('munge.pid')}", f"--seed-file={at('munge.seed')}", f"--log-file={at('munge.log')}")
        until("munge", lambda: os.path.exists(at("munge.socket")))
        self.start("slurmctld", "-D", "-i")
        self.start("slurmd", "-D", "-N", "farm")
        try:
            until("node", lambda: "idle" in self.ask("sinfo", "--noheader", "--format=%t"))
        except AssertionError:
            for log in ("slurmctld.log", "slurmd.log"):
                print(open(at(log)).read()[-3000:], file=sys.stderr)
            raise

    def start(self, *command):
        out = os.path.join(self.folder, f"{command[0]}.out")
        with open(out, "w") as log:
            environment = dict(os.environ, PATH=os.environ["PATH"] + ":/usr/sbin:/sbin")
            self.daemons.append(subprocess.Popen(command, stdout=log, stderr=log, env=environment))

    def ask(self, *command):
        return subprocess.run(command, capture_output=True, text=True).stdout

    def state(self, task):
        """Returns the states of a task: COMPLETED, RUNNING and so on."""
        shown = self.ask("scontrol", "--oneliner", "show", "job", task)
        return [word.removeprefix("JobState=") for word in shown.split() if word.startswith("JobState=")]

    def stop(self):
        self.ask("scancel", f"--user={getpass.getuser()}", "--quiet")
        for daemon in reversed(self.daemons):
            daemon.terminate()
            try:
                daemon.wait(10)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()


def slurm():
    file = job("slurm", "--at-once", "2")
    out = os.path.abspath("slurm/out")
    script = open(os.path.join("slurm", file)).read()
    last = script.split("exec \"$blinn\" ")[-1].replace("\\\n", " ")
    words = [w for w in shlex.split(last) if not w.startswith(("--chunk=", "--threads="))]

    cluster = Slurm(os.path.abspath("cluster"))
    try:
        os.environ["BLINN"] = BLINN
        submitted = run("bash", os.path.join("slurm", file))
        array, assembled = [line.split()[-1] for line in submitted.splitlines()]
        until("frames", lambda: len(frames(out)) >= 1)
        running = [n for n in (1, 2, 3) if cluster.state(f"{array}_{n}") == ["RUNNING"]]
        assert running, submitted
        before = workers(out)
        requested = time.time()
        run("scontrol", "requeue", f"{array}_{running[0]}")
        until("end of the task", lambda: sum(map(alive, before)) < len(before))
        took = time.time() - requested
        kept = {name: os.stat(name).st_mtime_ns for name in frames(out)}
        assert len(kept) < COUNT, "all tasks had ended before one was requeued"
        until("animation file", lambda: cluster.state(assembled) == ["COMPLETED"], 180)
        logs = "".join(open(log).read() for log in glob.glob("slurm/slurm-*.out"))
        assert "blinn: terminated" in logs, f"it did not exit on SIGTERM: {logs}"
        restarts = cluster.ask("scontrol", "--oneliner", "show", "job", f"{array}_{running[0]}")
        assert "Restarts=1" in restarts, restarts
        assert all(os.stat(name).st_mtime_ns == at for name, at in kept.items()), "finished frames were rendered again"
        compare("slurm", words)
        print(f"slurm: task {running[0]} stopped in {took:.1f} s at {len(kept)} of {COUNT} frames, and requeued: same bytes")
        # If a frame fails, nothing is assembled.
        os.environ["BLINN"] = "/bin/false"
        array, assembled = [line.split()[-1] for line in run("bash", os.path.join("slurm", file)).splitlines()]
        until("failure", lambda: cluster.state(assembled) == ["CANCELLED"])
        print("slurm: if a task fails, its dependent job leaves the queue")
    finally:
        cluster.stop()


if __name__ == "__main__":
    engines = sys.argv[2:] or ["openjd", "slurm"]
    with tempfile.TemporaryDirectory(prefix="farm-", ignore_cleanup_errors=True) as folder:
        os.chdir(folder)
        local()
        for engine in engines:
            {"openjd": openjd, "slurm": slurm}[engine]()
