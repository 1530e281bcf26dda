"""The steps of a conversion: open the file, show what renders, export."""

from __future__ import annotations

import argparse
import logging
import os
import re
import sys
import threading
from typing import Callable

import bpy

from . import engine_settings, render_state
from .export_options import export_options

Report = Callable[[str, str], None]

# Letters of the size of pointers, byte order and version; from Blender 5.0 on also the sizes of header and format.
HEADER = re.compile(rb"BLENDER(\d\d)?[-_](\d\d)?[vV]\d{3}")
DAMAGED = "it is damaged or was cut off; save it again in Blender, or use its backup (.blend1)"


class ConversionError(Exception):
    """A file that cannot be converted."""


def convert(options: argparse.Namespace, report: Report) -> None:
    """Converts a file, and reports linked files and what is lost."""
    if options.end_with_input:
        end_with_input(options.end_with_input)
    if options.memory:
        limit_memory(options.memory)
    open_file(options.input)
    enable_hook()
    scene, view_layer = choose_scene(options)
    for path in linked_files():
        report("file", path)
    if options.only_folder:
        remove_outside_images(os.path.dirname(options.input), report)
    for warning in warnings_of_file():
        report("warning", warning)
    with bpy.context.temp_override(**context_of(scene, view_layer)):
        render_state.show_what_renders(scene, view_layer)
        if options.frame is not None:
            frame = int(options.frame // 1)
            scene.frame_set(frame, subframe=options.frame - frame)
        bake = getattr(scene, engine_settings.PROPERTY)
        bake.bake, bake.bake_size = options.bake or bake.bake, options.bake_size or bake.bake_size
        export(options, scene, report)


def end_with_input(folder: str) -> None:
    """Ends this process, and removes its folder, when the program that holds its standard input open has ended."""

    def watch() -> None:
        try:
            while os.read(0, 4096):
                pass
        except OSError:
            return
        import shutil

        shutil.rmtree(folder, ignore_errors=True)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def limit_memory(limit: int) -> None:
    """Limits the memory that this process may allocate, where the system can."""
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
    except (ImportError, ValueError, OSError):
        pass


def open_file(path: str) -> None:
    """Opens a file without running its scripts."""
    try:
        bpy.ops.wm.open_mainfile(filepath=path, load_ui=False, use_scripts=False)
    except RuntimeError as error:
        reason = " ".join(str(error).split()).rsplit(": ", 1)[-1].replace(f' in file "{path}"', "")
        version = f"Blender {bpy.app.version_string}"
        if "newer version" in str(error):
            if has_version(path):
                reason = "a newer Blender saved it; name that one with `blender`. Files of Blender 5 need 4.5 or later"
                raise ConversionError(f"{version} cannot open it: {reason}") from error
            reason = "its header names no version"
        raise ConversionError(f"{version} cannot read it: {reason}; {DAMAGED}") from error


def has_version(path: str) -> bool:
    """Returns True for a file that names the version of its Blender, or that is compressed."""
    with open(path, "rb") as file:
        head = file.read(17)
    return not head.startswith(b"BLENDER") or HEADER.match(head) is not None


def enable_hook() -> None:
    """Enables the glTF exporter, and this package as its extension, in this process only."""
    import addon_utils

    package = __package__
    if addon_utils.enable("io_scene_gltf2") is None:
        raise ConversionError(f"Blender {bpy.app.version_string} has no glTF exporter")
    if package not in bpy.context.preferences.addons:
        bpy.context.preferences.addons.new().module = package
        sys.modules[package].register()


def choose_scene(options: argparse.Namespace) -> tuple[bpy.types.Scene, bpy.types.ViewLayer]:
    """Returns the scene and the view layer to export."""
    scene = bpy.context.scene
    if options.scene is not None:
        scenes = bpy.data.scenes
        scene = scenes.get(options.scene)
        if scene is None and options.scene.isdecimal() and int(options.scene) < len(scenes):
            scene = scenes[int(options.scene)]
        if scene is None:
            names = ", ".join(f"{i} '{scene.name}'" for i, scene in enumerate(scenes))
            raise ConversionError(f"there is no scene '{options.scene}'; the file has: {names}")
    layers = scene.view_layers
    rendered = [layer for layer in layers if layer.use] or list(layers)
    return scene, layers.get(options.view_layer or "") or rendered[0]


def context_of(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> dict[str, object]:
    """Returns the context in which a scene is exported."""
    window = bpy.context.window or (bpy.data.window_managers[0].windows or [None])[0]
    if window is not None:
        window.scene, window.view_layer = scene, view_layer
        return {"window": window}
    return {"scene": scene, "view_layer": view_layer}


def linked_files() -> list[str]:
    """Returns the absolute paths of all files that this one refers to and that are not packed."""
    paths = bpy.utils.blend_paths(absolute=True, packed=False, local=False)
    return sorted({os.path.normpath(path) for path in paths if "\n" not in path})


def remove_outside_images(folder: str, report: Report) -> None:
    """Takes the files of images away that are outside a folder. Blender reads images when they are needed."""
    folder = os.path.join(os.path.realpath(folder), "")
    outside = []
    for image in bpy.data.images:
        if image.source not in {"FILE", "SEQUENCE", "MOVIE", "TILED"} or image.packed_file is not None:
            continue
        path = bpy.path.abspath(image.filepath, library=image.library)
        if path and not os.path.realpath(path).startswith(folder):
            outside.append(path)
            image.filepath = ""
    if outside:
        if len(outside) == 1:
            text = f"image '{outside[0]}' is outside the scene's folder and was not read; allow it with `allow-outside`"
        else:
            text = f"{len(outside)} images outside the scene's folder were not read; allow them with `allow-outside`"
        report("warning", text)


def warnings_of_file() -> list[str]:
    """Returns what makes the scene differ from the one that its author sees."""
    warnings = []
    saved, own = tuple(bpy.data.version[:2]), tuple(bpy.app.version[:2])
    if saved > own:
        names = [".".join(map(str, version)) for version in (saved, own)]
        warnings.append(
            f"Blender {names[0]} saved the file and Blender {names[1]} opened it, which loses what is new; "
            "name a newer Blender with `blender`"
        )
    if bpy.app.autoexec_fail:
        warnings.append(f"the file's scripts were not run: {bpy.app.autoexec_fail_message}")
    missing = sum(1 for library in bpy.data.libraries if library.is_missing)
    if missing:
        warnings.append(f"{missing} linked .blend file(s) are missing; their objects are left out")
    return warnings


def export(options: argparse.Namespace, scene: bpy.types.Scene, report: Report) -> None:
    """Exports the scene, and reports the warnings of the hook."""

    class Warnings(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            message = record.getMessage()
            if record.levelno >= logging.WARNING and message.startswith("blinn: "):
                report("warning", message.removeprefix("blinn: "))

    logging.getLogger("glTFImporter").addHandler(Warnings())
    settings = export_options(scene, is_still=options.frame is not None)
    try:
        result = bpy.ops.export_scene.gltf(filepath=options.output, **settings)
    except RuntimeError as error:
        if "MemoryError" in str(error):
            raise MemoryError from error
        lines = str(error).strip().splitlines() or ["unknown error"]
        raise ConversionError(f"Blender's glTF exporter failed: {lines[-1]}") from error
    if result != {"FINISHED"}:
        raise ConversionError("Blender's glTF exporter was cancelled")
