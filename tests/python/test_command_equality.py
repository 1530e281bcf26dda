"""Pictures and layers equal those of the command bit for bit."""

import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

import blinn

SCENES = [
    "lecture/lecture.obj",
    "lecture/lecture.glb",
    "cornell/cornell.glb",
    "cornell/cornell.obj",
    "alpha/alpha.glb",
    "assembly/assembly.glb",
    "figure/figure.glb",
    "still-life/still-life.glb",
    "textured/textured.glb",
    "tower/tower.glb",
]


def run(*args: object) -> None:
    """Run the command of the package, or the program BLINN_COMMAND."""
    program = os.environ.get("BLINN_COMMAND")
    command = [program] if program else [sys.executable, "-m", "blinn"]
    subprocess.run([*command, *map(str, args)], check=True, capture_output=True)


def read_png(path: Path) -> np.ndarray:
    """Read an 8-bit PNG whose rows have filter types 0 to 4."""
    data = path.read_bytes()
    position, pixels, header = 8, b"", b""
    while position < len(data):
        (length,) = struct.unpack(">I", data[position : position + 4])
        kind, body = data[position + 4 : position + 8], data[position + 8 : position + 8 + length]
        if kind == b"IHDR":
            header = body
        elif kind == b"IDAT":
            pixels += body
        position += 12 + length
    width, height, depth, color = struct.unpack(">IIBB", header[:10])
    channels = {2: 3, 6: 4}[color]
    assert depth == 8
    raw = np.frombuffer(zlib.decompress(pixels), np.uint8).reshape(height, 1 + width * channels)
    out = np.zeros((height, width * channels), np.int32)
    for y in range(height):
        kind, row = raw[y, 0], raw[y, 1:].astype(np.int32)
        up = out[y - 1] if y else np.zeros_like(row)
        for x in range(len(row)):
            left = row[x - channels] if x >= channels else 0
            corner = up[x - channels] if x >= channels else 0
            estimate = left + up[x] - corner
            distances = [abs(estimate - v) for v in (left, up[x], corner)]
            paeth = (left, up[x], corner)[distances.index(min(distances))]
            row[x] = (row[x] + [0, left, up[x], (left + up[x]) // 2, paeth][kind]) & 255
        out[y] = row
    return out.reshape(height, width, channels).astype(np.uint8)


@pytest.mark.parametrize("name", SCENES)
def test_picture_equals_the_commands_png(name: str, models: Path, tmp_path: Path) -> None:
    file = tmp_path / "command.png"
    run("render", models / name, "--size", "64x48", "--samples", 4, "--ao", 4, "-o", file, "-q")
    picture = blinn.load(models / name).render(size=(64, 48), samples=4, ao=4)
    expected = read_png(file)
    np.testing.assert_array_equal(picture.rgba[:, :, : expected.shape[2]], expected)


@pytest.mark.parametrize("name", SCENES)
def test_saved_files_equal_the_commands(name: str, models: Path, tmp_path: Path) -> None:
    layers = ["depth", "normal", "position", "albedo", "object-id"]
    run("render", models / name, "--size", "48x32", "--aov", ",".join(layers), "-o", tmp_path / "command.exr", "-q")
    picture = blinn.load(models / name).render(size=(48, 32), layers=layers)
    picture.save(tmp_path / "python.exr")
    command, python = (read_exr(tmp_path / f"{who}.exr") for who in ("command", "python"))
    assert command == python


def read_exr(path: Path) -> bytes:
    """The pixel data of an EXR file, behind its header, which has a fingerprint in files of the command."""
    data = path.read_bytes()
    position = 8
    while data[position] != 0:
        name_end = data.index(b"\0", position)
        kind_end = data.index(b"\0", name_end + 1)
        (length,) = struct.unpack("<I", data[kind_end + 1 : kind_end + 5])
        position = kind_end + 5 + length
    table = data[position + 1 :]
    # The offsets of the blocks depend on the header's length. The first block begins where the table ends.
    (first,) = struct.unpack("<Q", table[:8])
    return data[first:]


def test_an_animation_equals_the_commands_frame(models: Path, tmp_path: Path) -> None:
    file = tmp_path / "command.png"
    scene = models / "figure/figure.glb"
    run("render", scene, "--size", "64x48", "--time", "0.5", "-o", file, "-q")
    picture = blinn.load(scene).pose(time=0.5).render(size=(64, 48))
    expected = read_png(file)
    np.testing.assert_array_equal(picture.rgba[:, :, : expected.shape[2]], expected)
