#!/usr/bin/env python3
"""Checks blinn's EXR files in OpenEXR: channels, types, windows and known values.

    exr.py BLINN

Two squares in the plane z = 0, one metre wide, at x = -1…0 (red) and 0…1 (half transparent, blue), y = 0…1, are rendered
from z = 3 with a view of 3 m × 2 m in that plane, so the position of each pixel centre is known. Needs numpy, OpenEXR and pillow.
"""
import json
import os
import subprocess
import sys
import tempfile

import numpy as np
import OpenEXR
from PIL import Image

BLINN = os.path.abspath(sys.argv[1])
W, H = 96, 60  # no centre lies on a diagonal
AOVS = "depth,normal,vertex-normal,geometric-normal,position,albedo,uv,mask,object-id,material-id,cryptomatte"
COLOR = ["R", "G", "B", "A"]
VECTORS = ["normal", "vertex-normal", "geometric-normal"]
FLOATS = ["depth.Z", "mask.A", "uv.U", "uv.V"] + [f"position.{c}" for c in "XYZ"]
HALVES = COLOR + [f"{v}.{c}" for v in VECTORS for c in "XYZ"] + [f"albedo.{c}" for c in "RGB"]
MATTES = {"crypto_object": ["left", "right"], "crypto_material": ["red", "glass"]}
FLOATS += [f"{m}0{i}.{c}" for m in MATTES for i in range(3) for c in COLOR]
IDS = ["object-id.I", "material-id.I"]

OBJ = """mtllib quads.mtl
v -1 0 0
v 0 0 0
v 0 1 0
v -1 1 0
v 1 0 0
v 1 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
o left
usemtl red
f 1/1 2/2 3/3 4/4
o right
usemtl glass
f 2/1 5/2 6/3 3/4
"""
MTL = "newmtl red\nKd .75 .25 .125\nnewmtl glass\nKd 0 .5 1\nd .5\n"
VIEW = "--view-point 0,0,3 --view-dir 0,0,-1 --proj-distance 3 --view-width 3 --view-height 2".split()
LIGHT = "--lights none --sun 0,0,-1,1 --ambient 0,0,0 --exposure 0 --view raw".split()


def render(out, *flags):
    size = ["--size", f"{W}x{H}", "-s", "1", "-q"]
    subprocess.run([BLINN, "render", "quads.obj", "-o", out, *size, *VIEW, *LIGHT, *flags], check=True)
    return out


def read(path):
    """Returns data and display window, text attributes, and channels as read by OpenEXR."""
    with OpenEXR.File(path, separate_channels=True) as file:
        assert len(file.parts) == 1, "one part"
        header = file.header()
        windows = [tuple(int(v) for corner in header[w] for v in corner) for w in ("dataWindow", "displayWindow")]
        texts = {k: v for k, v in header.items() if isinstance(v, str)}
        return windows, texts, {name: c.pixels.copy() for name, c in file.channels().items()}


def same(name, found, expected, tolerance=0.0):
    found, expected = np.broadcast_arrays(np.asarray(found, np.float64), np.asarray(expected, np.float64))
    with np.errstate(invalid="ignore"):  # inf - inf
        wrong = ~((found == expected) | (np.abs(found - expected) <= tolerance))
    assert not wrong.any(), f"{name}: {wrong.sum()} differ, {found[wrong][:3]} for {expected[wrong][:3]}"


def check_geometry(channels):
    """Checks every value that follows from the geometry; returns the masks of both squares."""
    x = (np.arange(W) + 0.5) / W * 3 - 1.5
    y = 1 - (np.arange(H) + 0.5) / H * 2
    x, y = np.meshgrid(x, y)
    left = (x > -1) & (x < 0) & (y > 0) & (y < 1)
    right = (x > 0) & (x < 1) & (y > 0) & (y < 1)
    hit = left | right
    assert left.sum() == 960 and right.sum() == 960
    same("depth", channels["depth.Z"], np.where(hit, 3, np.inf), 1e-6)
    for axis, where in zip("XYZ", (x, y, 0 * x)):
        same(f"position.{axis}", channels[f"position.{axis}"], np.where(hit, where, 0), 1e-6)
    for v in VECTORS:
        for axis, n in zip("XYZ", (0, 0, 1)):
            same(f"{v}.{axis}", channels[f"{v}.{axis}"], np.where(hit, n, 0))
    same("u", channels["uv.U"], np.where(hit, np.where(left, x + 1, x), 0), 1e-6)
    same("v", channels["uv.V"], np.where(hit, 1 - y, 0), 1e-6)
    same("mask", channels["mask.A"], hit)
    for name in IDS:
        same(name, channels[name], np.where(left, 1, np.where(right, 2, 0)))
    kd = {"R": (0.75, 0), "G": (0.25, 0.5), "B": (0.125, 1)}
    for c, (red, glass) in kd.items():
        same(f"albedo.{c}", channels[f"albedo.{c}"], np.where(left, red, np.where(right, glass, 0)))
        # Lit straight on by E = 1, the glass over the background of .05.
        same(c, channels[c], np.where(left, red, np.where(right, glass / 2 + 0.025, 0.05)), 1e-3)
    same("A", channels["A"], 1)
    return left, right


def check_cryptomatte(texts, channels, squares):
    """Checks names, metadata and coverages: one object per square, the second half transparent."""
    for layer, names in MATTES.items():
        key = next(k for k, v in texts.items() if k.startswith("cryptomatte/") and v == layer)
        manifest = json.loads(texts[key.replace("/name", "/manifest")])
        assert list(manifest) == names, manifest
        assert texts[key.replace("/name", "/hash")] == "MurmurHash3_32"
        assert texts[key.replace("/name", "/conversion")] == "uint32_to_float32"
        first, cover = channels[f"{layer}00.R"].view(np.uint32), channels[f"{layer}00.G"]
        left, right = squares
        red, glass = (int(manifest[n], 16) for n in names)
        same(f"{layer} id", first, np.where(left, red, np.where(right, glass, 0)))
        same(f"{layer} coverage", cover, np.where(left, 1, np.where(right, 0.5, 0)))
        for rank in ("00.B", "00.A", "01.R", "02.G"):
            same(f"{layer}{rank}", channels[f"{layer}{rank}"], 0)


def main():
    render("full.exr", "--aov", AOVS)
    windows, texts, full = read("full.exr")
    assert windows == [(0, 0, W - 1, H - 1)] * 2, windows
    assert sorted(full) == sorted(HALVES + FLOATS + IDS), sorted(full)
    for name, pixels in full.items():
        assert pixels.shape == (H, W) and pixels.dtype == (np.uint32 if name in IDS else np.float32), name
    check_cryptomatte(texts, full, check_geometry(full))

    # Half floats are the rounded floats, only in channels where they suffice.
    _, _, half = read(render("half.exr", "--aov", AOVS, "--depth", "16"))
    assert sorted(half) == sorted(full)
    for name, pixels in half.items():
        assert pixels.dtype == (np.uint32 if name in IDS else np.float16 if name in HALVES else np.float32), name
        same(f"half {name}", pixels, full[name].astype(pixels.dtype))

    # A crop is a part of the same picture, at its position.
    x, y, w, h = 31, 7, 40, 21
    windows, _, part = read(render("crop.exr", "--aov", AOVS, "--crop", f"{x},{y},{w},{h}"))
    assert windows == [(x, y, x + w - 1, y + h - 1), (0, 0, W - 1, H - 1)], windows
    for name, pixels in part.items():
        same(f"crop {name}", pixels, full[name][y : y + h, x : x + w])

    # Premultiplied alpha here, straight alpha in PNG.
    _, _, clear = read(render("clear.exr", "--background", "transparent"))
    assert sorted(clear) == sorted(COLOR)
    render("clear.png", "--background", "transparent", "--depth", "8")
    png = np.asarray(Image.open("clear.png").convert("RGBA"), np.float64) / 255
    same("alpha", png[..., 3], clear["A"], 0.5 / 255 + 1e-6)
    assert set(np.unique(clear["A"])) == {0, 0.5, 1}, np.unique(clear["A"])
    for i, c in enumerate("RGB"):
        same(f"straight {c}", png[..., i] * clear["A"], clear[c], 0.5 / 255 + 1e-6)
    print(f"EXR: {len(full)} channels read, {len(half) + len(part)} more as halves and crop")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for name, text in (("quads.obj", OBJ), ("quads.mtl", MTL)):
            with open(name, "w") as f:
                f.write(text)
        main()
