#!/usr/bin/env python3
"""Checks that the three ways from a .blend file to a picture give the same light, close to Cycles' own picture.

    blend.py BLINN PYTHON...

PYTHON has bpy, the Python module of blinn and numpy. The ways: a GLB of Blender's exporter with the extension, the render
engine, and `blinn render scene.blend`, none with flags of the scene. Needs numpy, OpenEXR, pillow and flip-evaluator, and the
reference corpus beside the checkout.
"""
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR
from flip_evaluator import evaluate
from PIL import Image

HERE = Path(__file__).absolute().parent
SCENES = HERE.parent.parent / "shared/corpus/scenes"
# Of the pictures that are compared with each other, and of those that are compared with Cycles.
FEW, MANY = "2", "16"
# Blender's bevels compute the last bits of texture coordinates differently from run to run. A step of 8 bits is 16 times this.
LAST_BITS = 2.0**-12
# Mean FLIP of one scene to Cycles' picture.
WORST = 0.042


def main():
    if not SCENES.is_dir():
        print(f"!! NO REFERENCE CORPUS at {SCENES}: its .blend files were NOT rendered", file=sys.stderr)
        return 0
    program, pythons = os.path.abspath(sys.argv[1]), sys.argv[2:]
    failures = 0
    for python in pythons:
        flips = []
        for case in sorted(SCENES.glob("*/case.json")):
            with tempfile.TemporaryDirectory() as folder:
                failures += not check(program, python, case.parent, Path(folder), flips)
        print(f"{len(flips)} scenes, mean FLIP {sum(flips) / len(flips):.3f}, worst {max(flips):.3f} (at most {WORST})")
    return 1 if failures else 0


def check(program, python, scene, folder, flips):
    """Renders a scene in three ways, and returns True if they agree with each other and with Cycles."""
    blend = scene / "scene.blend"
    log = folder / "log.txt"
    with open(log, "wb") as output:
        command = [python, HERE / "blend_in_blender.py", blend, folder, FEW]
        run(command, stdout=output, stderr=output, log=log)
    version = (folder / "version.txt").read_text()
    environment = {**os.environ, "BLINN_BLENDER": python, "BLINN_CACHE": str(folder / "cache")}
    quiet = ["--progress", "none", "-q"]
    for name, file in [("hook", folder / "scene.glb"), ("blend", blend)]:
        words = [program, "render", file, "-o", folder / f"{name}.exr", "--depth", "32", "-s", FEW, *quiet]
        run(words, env=environment)
    run([program, "render", blend, "-o", folder / "best.png", "-s", MANY, *quiet], env=environment)
    lights = {name: light(folder / f"{name}.exr") for name in ("hook", "engine", "blend")}
    is_right = True
    for way in ("hook", "engine"):
        if lights[way].shape != lights["blend"].shape:
            is_right = fail(scene, f"{way}: {lights[way].shape}, not {lights['blend'].shape}")
            continue
        errors = np.abs(lights[way] - lights["blend"])
        if not errors.max() <= LAST_BITS:
            count = (errors > LAST_BITS).any(-1).sum()
            is_right = fail(scene, f"{count} pixels of {way} differ from `blinn render`, by up to {errors.max():g}")
    pictures = load(scene / "ref.png"), load(folder / "best.png")
    as_floats = [image.astype(np.float32) / 255.0 for image in pictures]
    mean = evaluate(*as_floats, "LDR")[1]
    flips.append(mean)
    if mean > WORST:
        is_right = fail(scene, f"FLIP to Cycles {mean:.3f}")
    print(f"{scene.name} in Blender {version}: FLIP {mean:.3f}{', the same light in three ways' if is_right else ''}", flush=True)
    return is_right


def run(command, log=None, **options):
    status = subprocess.run([str(word) for word in command], **options).returncode
    if status:
        lines = log.read_text(errors="replace").splitlines()[-20:] if log else []
        sys.exit("\n".join([*lines, f"exit {status}: {' '.join(map(str, command))}"]))


def fail(scene, text):
    print(f"!! {scene.name}: {text}", flush=True)
    return False


def load(path):
    return np.asarray(Image.open(path).convert("RGB"))


def light(path):
    """Returns red, green and blue of an OpenEXR file."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name.split(".")[-1]: channel.pixels for name, channel in file.channels().items()}
    return np.stack([channels[c] for c in "RGB"], axis=-1)


if __name__ == "__main__":
    sys.exit(main())
