"""Renders 500 scenes, a fifth of them broken, slow or large, on 1, 2, 7 and 64 threads and with --resume after kills, and
compares images, ledgers and messages with those of one thread: `python3 benches/stress.py PROGRAM [SCENES]`.

A run without kills must have the same messages, line by line, and the same ledger but for seconds and the versions of
files. Runs that are killed are resumed until they end; then images and the outcome of each scene in the ledger must be
the same, and one more --resume must have the messages that it has after one thread.
"""

import hashlib
import json
import random
import re
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

THREADS = [2, 7, 64]
KILLS = 8
# Seconds for a run, and for all runs of a number of threads.
LIMIT = 1800
# Numbers that differ from run to run.
TIMES = re.compile(r"\b\d+(\.\d+)? ?(ms|s|min)\b")


def obj(random_numbers, triangles):
    """Returns an OBJ of separate triangles."""
    lines = []
    for _ in range(triangles):
        x, y, z = (random_numbers.uniform(-1, 1) for _ in range(3))
        for _ in range(3):
            corner = (v + random_numbers.uniform(-0.3, 0.3) for v in (x, y, z))
            lines.append("v %.4f %.4f %.4f" % tuple(corner))
        lines.append("f -3 -2 -1")
    return "\n".join(lines).encode()


def glb(random_numbers, triangles, stated=None):
    """Returns a GLB of separate triangles, which may state more vertices than it has."""
    numbers = [random_numbers.uniform(-1, 1) for _ in range(9 * triangles)]
    binary = struct.pack(f"<{len(numbers)}f", *numbers)
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": stated or 3 * triangles}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": len(binary)}],
        "buffers": [{"byteLength": len(binary)}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def write_scenes(folder, count):
    """Writes the scenes and the list of them."""
    names = []
    for i in range(count):
        numbers = random.Random(i)
        small = numbers.randrange(1, 400)
        troubles = [
            ("obj", lambda: b"v 0 0 0\nv 1 0 0\nf 1 2 9\n"),
            ("glb", lambda: glb(numbers, small)[: -4 * small]),
            ("glb", lambda: glb(numbers, 1, stated=3_000_000_000)),
            ("gltf", lambda: b'{"asset": {"version": "2.0"}, "nodes": ['),
            ("stl", lambda: numbers.randbytes(700)),
            ("obj", None),
            ("obj", lambda: obj(numbers, 10_000)),
            ("glb", lambda: glb(numbers, 60_000)),
        ]
        make = obj if i % 2 else glb
        good = (make.__name__, lambda: make(numbers, small))
        kind, content = troubles[i // 5 % len(troubles)] if i % 5 == 3 else good
        name = f"{i:03}.{kind}"
        names.append(name)
        if content is not None:
            (folder / name).write_bytes(content())
    (folder / "list").write_text("".join(f"../scenes/{name}\n" for name in names))


class Run:
    """A folder with the images and the ledger of a number of threads, where the program runs."""

    def __init__(self, program, folder, threads):
        self.folder = folder
        flags = "--size 48x32 -s 2 --max-memory 2GiB --progress none --resume -o {stem}.png --ledger ledger"
        self.line = [program, "render", "@../scenes/list", *flags.split(), "--threads", str(threads)]
        folder.mkdir()

    def start(self):
        return subprocess.Popen(self.line, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)

    def messages(self):
        """Runs to the end and returns the messages without times."""
        process = self.start()
        text = process.communicate(timeout=LIMIT)[1].decode()
        assert process.returncode == 1, f"{self.folder}: exit code {process.returncode}, not 1\n{text[-2000:]}"
        return TIMES.sub("TIME", text).splitlines()

    def images(self):
        files = sorted(self.folder.glob("*.png"))
        return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}

    def ledger(self):
        """Returns the lines of the ledger without seconds and times of modification."""
        lines = []
        for line in (self.folder / "ledger").read_text().splitlines():
            try:
                entry = json.loads(line)
            except ValueError:
                # A kill may cut a line.
                continue
            lines.append({key: value for key, value in entry.items() if key not in ("seconds", "files_version")})
        return lines

    def outcomes(self):
        """Returns how each scene ended, whether its image was written or kept from a run before. Warnings are left out: a
        scene whose image is kept is not read."""
        fields = ("status", "error", "key")
        last = {entry["scene"]: entry for entry in self.ledger()}
        return {
            scene: [entry.get(field) for field in fields] + [entry["images"] + entry["kept"]]
            for scene, entry in last.items()
        }


def expect_same(what, name, expected, found):
    if expected == found:
        return
    if isinstance(expected, dict):
        expected, found = sorted(expected.items()), sorted(found.items())
    pairs = [(a, b) for a, b in zip(expected, found) if a != b]
    first = pairs[0] if pairs else f"{len(expected)} and {len(found)} of them"
    sys.exit(f"{name}: other {what} than one thread: {first}")


def main():
    program = str(Path(sys.argv[1]).resolve())
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 500
    kills = random.Random(7)
    with tempfile.TemporaryDirectory() as temporary:
        scenes = Path(temporary) / "scenes"
        scenes.mkdir()
        write_scenes(scenes, count)
        one = Run(program, Path(temporary) / "one", 1)
        start = time.monotonic()
        messages = one.messages()
        alone = time.monotonic() - start
        images, ledger = one.images(), one.ledger()
        outcomes, again = one.outcomes(), one.messages()
        failed = sum(status == "failed" for status, *_ in outcomes.values())
        print(f"1 thread: {len(images)} images, {failed} failed scenes, {alone:.1f} s", flush=True)
        assert len(images) >= 4 * count // 5 and failed >= count // 10, "some scenes fail, most do not"
        for threads in THREADS:
            end = time.monotonic() + LIMIT
            run = Run(program, Path(temporary) / f"threads-{threads}", threads)
            start = time.monotonic()
            expect_same("messages", run.folder.name, messages, run.messages())
            whole = time.monotonic() - start
            expect_same("images", run.folder.name, images, run.images())
            expect_same("ledger", run.folder.name, ledger, run.ledger())
            killed = Run(program, Path(temporary) / f"killed-{threads}", threads)
            count_killed = 0
            for _ in range(KILLS):
                process = killed.start()
                try:
                    process.communicate(timeout=kills.uniform(0.02, 0.2) * whole)
                except subprocess.TimeoutExpired:
                    process.send_signal(signal.SIGKILL)
                    process.communicate()
                    count_killed += 1
                assert time.monotonic() < end, f"{killed.folder.name}: not finished after {LIMIT} s"
            assert count_killed > 0, f"{killed.folder.name}: no run was killed"
            killed.messages()
            expect_same("images", killed.folder.name, images, killed.images())
            expect_same("ledger", killed.folder.name, outcomes, killed.outcomes())
            expect_same("messages", killed.folder.name, again, killed.messages())
            print(f"{threads} threads: same images, ledger and messages; {count_killed} kills", flush=True)


if __name__ == "__main__":
    main()
