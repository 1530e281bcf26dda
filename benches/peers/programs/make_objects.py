"""Writes textured GLB files of 1,000 to 50,000 triangles, the same for the same numbers: `make_objects.py FOLDER COUNT`.

Each has one to six closed parts (noisy spheres, tori, vases, plates) with their own materials; half of these have textures
of 256 to 1,024 pixels as PNG or JPEG, a quarter normal maps. Files that exist are kept.
"""

import io
import json
import struct
import sys
from pathlib import Path

import numpy as np
from PIL import Image


def noise(rng, side, octaves=6):
    """Smooth noise, 0 … 1, that repeats at its edges."""
    total, weight = np.zeros((side, side)), 0.0
    for octave in range(octaves):
        cells = min(4 << octave, side)
        grid = np.pad(rng.random((cells, cells)), ((0, 1), (0, 1)), mode="wrap")
        at = np.arange(side) * cells / side
        low, part = at.astype(int), at % 1
        part = part * part * (3 - 2 * part)
        rows = grid[low] * (1 - part)[:, None] + grid[low + 1] * part[:, None]
        total += (rows[:, low] * (1 - part) + rows[:, low + 1] * part) / 2 ** octave
        weight += 1 / 2 ** octave
    return total / weight


def encoded(rng, pixels):
    """A picture as the bytes of a PNG or JPEG file, and its type."""
    out = io.BytesIO()
    if rng.random() < 0.5:
        Image.fromarray(pixels).save(out, "PNG", compress_level=6)
        return out.getvalue(), "image/png"
    Image.fromarray(pixels).save(out, "JPEG", quality=90)
    return out.getvalue(), "image/jpeg"


def base_color(rng, side):
    first, second = rng.random(3), rng.random(3)
    mix = noise(rng, side)[..., None]
    grain = rng.random((side, side, 1)) * 0.06
    return ((first * mix + second * (1 - mix)) * 0.9 + grain).clip(0, 1) * 255


def normal_map(rng, side):
    height = noise(rng, side) * side * 0.04
    x, y = (height - np.roll(height, 1, axis) for axis in (1, 0))
    n = np.stack([-x, y, np.ones_like(x)], -1)
    return (n / np.linalg.norm(n, axis=-1, keepdims=True) * 0.5 + 0.5) * 255


def surface(rng, kind, triangles):
    """Positions, normals and texture coordinates on a grid, and its triangles."""
    rows = max(4, int((triangles / 4) ** 0.5))
    columns = max(6, triangles // (2 * rows))
    v, u = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij"))
    angle = 2 * np.pi * u
    if kind == "sphere":
        polar = np.pi * v
        bumps = 1 + 0.15 * sum(np.sin(rng.integers(1, 9) * angle + rng.random() * 6)
                               * np.sin(rng.integers(1, 9) * polar) / 3 for _ in range(6))
        p = bumps[:, None] * np.stack([np.sin(polar) * np.cos(angle), np.cos(polar), np.sin(polar) * np.sin(angle)], -1)
    elif kind == "torus":
        tube, knots = 0.2 + 0.2 * rng.random(), rng.integers(0, 5)
        around = 2 * np.pi * v
        radius = 1 + tube * np.cos(around)
        p = np.stack([radius * np.cos(angle), tube * np.sin(around) + 0.2 * np.sin(knots * angle), radius * np.sin(angle)], -1)
    elif kind == "vase":
        knots = rng.random(8) * 0.7 + 0.15
        radius = np.interp(v, np.linspace(0, 1, 8), knots) * (1 + 0.05 * np.cos(rng.integers(0, 24) * angle))
        p = np.stack([radius * np.cos(angle), 2 - 2 * v, radius * np.sin(angle)], -1)
    else:
        p = np.stack([2 * u - 1, 0.2 * np.sin(7 * u + rng.random()) * np.cos(5 * v), 2 * v - 1], -1)
    grid = p.reshape(rows + 1, columns + 1, 3)
    n = np.cross(np.gradient(grid, axis=1), np.gradient(grid, axis=0)).reshape(-1, 3)
    length = np.linalg.norm(n, axis=-1, keepdims=True)
    n = np.where(length > 0, n / np.maximum(length, 1e-30), [0, 1, 0])
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    across, down = corner + 1, corner + columns + 1
    faces = np.concatenate([np.stack([corner, across, down], -1), np.stack([across, down + 1, down], -1)])
    return p, n, np.stack([u, v], -1) * rng.integers(1, 4), faces


class Glb:
    """A file that is being put together."""

    def __init__(self):
        self.json = {"asset": {"version": "2.0", "generator": "make_objects.py"}, "buffers": [{}], "scene": 0}
        self.bytes = bytearray()

    def add(self, key, item):
        self.json.setdefault(key, []).append(item)
        return len(self.json[key]) - 1

    def view(self, data, **more):
        view = {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data), **more}
        self.bytes += data + b"\0" * (-len(data) % 4)
        return self.add("bufferViews", view)

    def accessor(self, array, component, kind, target):
        bounds = {"min": array.min(0).tolist(), "max": array.max(0).tolist()} if kind == "VEC3" else {}
        view = self.view(array.tobytes(), target=target)
        return self.add("accessors", {"bufferView": view, "componentType": component, "count": len(array),
                                      "type": kind, **bounds})

    def texture(self, rng, pixels):
        data, mime = encoded(rng, pixels.astype(np.uint8))
        image = self.add("images", {"bufferView": self.view(data), "mimeType": mime})
        return {"index": self.add("textures", {"source": image})}

    def write(self, path):
        self.json["buffers"][0]["byteLength"] = len(self.bytes)
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(self.bytes))
        chunks = [head, struct.pack("<I4s", len(text), b"JSON"), text,
                  struct.pack("<I4s", len(self.bytes), b"BIN\0"), bytes(self.bytes)]
        path.write_bytes(b"".join(chunks))


def material(glb, rng):
    pbr = {"metallicFactor": float(rng.random() < 0.2), "roughnessFactor": float(0.2 + 0.7 * rng.random())}
    made = {"pbrMetallicRoughness": pbr}
    side = int(rng.choice([256, 512, 1024]))
    if rng.random() < 0.5:
        pbr["baseColorTexture"] = glb.texture(rng, base_color(rng, side))
    else:
        pbr["baseColorFactor"] = [*rng.random(3).tolist(), 1.0]
    if rng.random() < 0.25:
        made["normalTexture"] = glb.texture(rng, normal_map(rng, side))
    return glb.add("materials", made)


def write_object(path, number):
    rng = np.random.default_rng([48, number])
    triangles = 1000 * 50 ** rng.random()
    glb, parts = Glb(), int(rng.integers(1, 7))
    for part in range(parts):
        p, n, uv, faces = surface(rng, rng.choice(["sphere", "torus", "vase", "plate"]), int(triangles / parts))
        place = rng.normal(size=3) * 0.8 * (parts > 1)
        p = p * (0.4 + 0.6 * rng.random()) + place
        attributes = {"POSITION": glb.accessor(p.astype(np.float32), 5126, "VEC3", 34962),
                      "NORMAL": glb.accessor(n.astype(np.float32), 5126, "VEC3", 34962),
                      "TEXCOORD_0": glb.accessor(uv.astype(np.float32), 5126, "VEC2", 34962)}
        indices = glb.accessor(faces.astype(np.uint32).ravel(), 5125, "SCALAR", 34963)
        made = material(glb, rng) if part == 0 or rng.random() < 0.7 else 0
        mesh = glb.add("meshes", {"primitives": [{"attributes": attributes, "indices": indices, "material": made}]})
        glb.add("nodes", {"mesh": mesh, "name": f"part {part + 1}"})
    if not any("baseColorTexture" in m["pbrMetallicRoughness"] for m in glb.json["materials"]):
        first = glb.json["materials"][0]["pbrMetallicRoughness"]
        first["baseColorTexture"] = glb.texture(rng, base_color(rng, 512))
    glb.add("scenes", {"nodes": list(range(parts))})
    glb.write(path)


folder, count = Path(sys.argv[1]), int(sys.argv[2])
folder.mkdir(parents=True, exist_ok=True)
for number in range(count):
    path = folder / f"{number:05}.glb"
    if not path.exists():
        write_object(path, number)
