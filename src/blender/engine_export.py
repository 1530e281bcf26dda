"""The scene of a render as a GLB, by another Blender in the background.

The exporter changes what it exports, and must not run in the thread that renders.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Callable, NamedTuple

import bpy

SCRIPT = Path(__file__).resolve().parent / "convert.py"
PERIOD = 0.05  # Seconds between looks at the other Blender.


class ExportError(Exception):
    """The scene was not exported."""


class Exported(NamedTuple):
    """A scene as a file."""

    glb: Path
    warnings: list[str]


def export(depsgraph: bpy.types.Depsgraph, folder: Path, is_cancelled: Callable[[], bool]) -> Exported | None:
    """Exports the scene at its current frame into ``folder``; None after a cancellation."""
    save_copy(depsgraph.scene.original, folder)
    return convert(choice_of(depsgraph), folder, is_cancelled)


def save_copy(scene: bpy.types.Scene, folder: Path) -> None:
    """Saves the scene as it is in memory, with its unsaved changes."""
    bpy.data.libraries.write(str(folder / "scene.blend"), {scene}, path_remap="ABSOLUTE")


def choice_of(depsgraph: bpy.types.Depsgraph) -> list[str]:
    """Returns the arguments that choose scene, view layer and frame."""
    scene, view_layer = depsgraph.scene, depsgraph.view_layer
    frame = scene.frame_current + scene.frame_subframe
    return [f"--scene={scene.name}", f"--view-layer={view_layer.name}", f"--frame={frame}"]


def convert(choice: list[str], folder: Path, is_cancelled: Callable[[], bool]) -> Exported | None:
    """Exports the copy in ``folder``; None after a cancellation. Any thread may call it."""
    copy, glb, report = folder / "scene.blend", folder / "scene.glb", folder / "report.txt"
    command = [*program(), "--input", copy, "--output", glb, "--report", report, "--end-with-input", folder, *choice]
    # Blender makes a folder of its own, and leaves it behind where it is killed.
    temporary = folder / "tmp"
    temporary.mkdir(exist_ok=True)
    environment = {**os.environ, **dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(temporary))}
    with open(folder / "log.txt", "wb") as log:
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=log, stderr=log, env=environment) as process:
            while True:
                try:
                    status = process.wait(PERIOD)
                    break
                except subprocess.TimeoutExpired:
                    if is_cancelled():
                        process.kill()
                        return None
    lines = [line.split(" ", 1) for line in os.fsdecode(report.read_bytes()).splitlines()] if report.exists() else []
    if status != 0 or not glb.exists():
        errors = [text for key, text in lines if key == "error"]
        printed = (folder / "log.txt").read_text(errors="replace").strip().splitlines()
        raise ExportError((errors or printed[-1:] or [f"Blender ended with {status}"])[0])
    return Exported(glb, [text for key, text in lines if key == "warning"])


def program() -> list[object]:
    """Returns the start of a command line that runs the script: this Blender, or this Python with bpy."""
    if bpy.app.binary_path:
        options = ["--background", "--factory-startup", "--disable-autoexec", "-noaudio", "--python-exit-code", "1"]
        return [bpy.app.binary_path, *options, "--python", SCRIPT, "--"]
    return [sys.executable, SCRIPT]
