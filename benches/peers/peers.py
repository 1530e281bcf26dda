"""Programs that others install, and processes that are measured."""

import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = Path(__file__).resolve().parent / "programs"
SCENES, WORK = ROOT / "target/scenes", ROOT / "target/peers"
PYTHON = WORK / "venv/bin/python"
BLINN, GENERATOR = ROOT / "target/release/blinn", ROOT / "target/release/blinn-scenes"
VERSIONS = {"f3d": "f3d==4.0.0", "mitsuba": "mitsuba==3.9.1", "filly": "filly==0.2.1", "PIL": "pillow", "numpy": "numpy"}


def has(module, python=PYTHON):
    """Returns true if a Python has a module."""
    done = subprocess.run([python, "-c", f"import {module}"], capture_output=True) if python else None
    return done is not None and done.returncode == 0


def blender_python():
    """A Python with bpy: the one named by BPY_PYTHON, or our own."""
    named = os.environ.get("BPY_PYTHON")
    return next((p for p in (named, PYTHON) if p and has("bpy", p)), None)


def install(*modules):
    """Installs modules into a virtual environment of our own."""
    if not PYTHON.exists():
        subprocess.run([sys.executable, "-m", "venv", WORK / "venv"], check=True)
    for module in modules:
        if not has(module):
            subprocess.run([PYTHON, "-m", "pip", "install", "--quiet", VERSIONS[module]], check=False)


def measure_process(command):
    """Runs a command. Returns wall s, CPU s and peak MB, or an error message."""
    start = time.perf_counter()
    with open(WORK / "last.log", "w") as log:
        process = subprocess.Popen([str(c) for c in command], stdout=log, stderr=log, cwd=WORK)
        _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    wall = time.perf_counter() - start
    if process.returncode != 0:
        tail = (WORK / "last.log").read_text(errors="replace").strip().splitlines()[-1:]
        return f"exit {process.returncode}: {' '.join(tail)[:160]}"
    return wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3
