"""Passes of a view layer from the layers of a picture."""

from __future__ import annotations

import json
from typing import Any, Iterator, NamedTuple

import bpy
import numpy

# Layers of blinn that become passes: layer, the view layer's switch, and names of the pass in Blender 5 and before.
DATA_PASSES = [
    ("depth", "use_pass_z", ["Depth"], "Z", "VALUE"),
    ("normal", "use_pass_normal", ["Normal"], "XYZ", "VECTOR"),
    ("position", "use_pass_position", ["Position"], "XYZ", "VECTOR"),
    ("object-id", "use_pass_object_index", ["Object Index", "IndexOB"], "X", "VALUE"),
    ("material-id", "use_pass_material_index", ["Material Index", "IndexMA"], "X", "VALUE"),
]
MATTES = [
    ("object", "use_pass_cryptomatte_object", "CryptoObject"),
    ("material", "use_pass_cryptomatte_material", "CryptoMaterial"),
]
CRYPTOMATTE = "cryptomatte"
# Ids of a pixel that blinn keeps.
RANKS = 6
# Depth where nothing is, as Cycles has it.
FAR = 1e10


class Pass(NamedTuple):
    """A pass of a view layer."""

    name: str
    channels: str
    kind: str
    layer: str


def passes_of(view_layer: bpy.types.ViewLayer) -> Iterator[Pass]:
    """Returns the passes that a view layer asks for, beside the combined one."""
    is_old = bpy.app.version < (5, 0, 0)
    for layer, switch, names, channels, kind in DATA_PASSES:
        if getattr(view_layer, switch):
            yield Pass(names[-1 if is_old else 0], channels, kind, layer)
    for matte, switch, name in MATTES:
        if getattr(view_layer, switch):
            # Lowercase channels are compressed without loss.
            for i in range(levels(view_layer) // 2):
                yield Pass(f"{name}{i:02d}", "rgba", "COLOR", f"{CRYPTOMATTE}-{matte}")


def levels(view_layer: bpy.types.ViewLayer) -> int:
    """Returns the number of ids of a pixel, which is even."""
    return (min(view_layer.pass_cryptomatte_depth, RANKS) + 1) // 2 * 2


def layers_of(view_layer: bpy.types.ViewLayer) -> list[str]:
    """Returns the names of the layers that ``blinn.Scene.render`` renders for the passes."""
    names = [CRYPTOMATTE if p.layer.startswith(CRYPTOMATTE) else p.layer for p in passes_of(view_layer)]
    return list(dict.fromkeys(names))


def pixels(wanted: Pass, picture: Any, scene: Any, view_layer: bpy.types.ViewLayer) -> numpy.ndarray:
    """Returns a pass as floats, height x width x channels, with the uppermost row first."""
    if wanted.layer.startswith(CRYPTOMATTE):
        kind = wanted.layer.removeprefix(f"{CRYPTOMATTE}-")
        return matte(picture, kind, names_of(scene, kind), int(wanted.name[-2:]), levels(view_layer))
    values = picture[wanted.layer]
    if wanted.layer == "depth":
        return numpy.where(numpy.isfinite(values), values, FAR)[..., None]
    if wanted.layer in {"normal", "position"}:
        # From glTF's axes to Blender's.
        return numpy.stack([values[..., 0], -values[..., 2], values[..., 1]], axis=-1)
    kind, data = ("object", bpy.data.objects) if wanted.layer == "object-id" else ("material", bpy.data.materials)
    indices = [0] + [data[name].pass_index if name in data else 0 for name in names_of(scene, kind)]
    return numpy.array(indices, numpy.float32)[values][..., None]


def names_of(scene: Any, kind: str) -> list[str]:
    """Returns the names of objects or materials: name i is that of id i + 1."""
    return scene.objects if kind == "object" else [material["name"] for material in scene.materials]


def matte(picture: Any, kind: str, names: list[str], index: int, count: int) -> numpy.ndarray:
    """Returns a layer of a Cryptomatte: id, coverage, id, coverage."""
    ids, coverage = picture.matte(kind)
    hashes = numpy.array([0] + [matte_id(name) for name in names], numpy.uint32).view(numpy.float32)
    ids, coverage = hashes[ids[..., :count]], coverage[..., :count]
    first = 2 * index
    columns = [ids[..., first], coverage[..., first], ids[..., first + 1], coverage[..., first + 1]]
    return numpy.stack(columns, axis=-1)


def manifests(view_layer: bpy.types.ViewLayer, scene: Any) -> Iterator[tuple[str, str]]:
    """Returns keys and values that readers of Cryptomattes need."""
    for kind, switch, name in MATTES:
        if getattr(view_layer, switch):
            full = f"{view_layer.name}.{name}"
            key = f"cryptomatte/{matte_id(full):08x}"[:19]
            yield f"{key}/name", full
            yield f"{key}/hash", "MurmurHash3_32"
            yield f"{key}/conversion", "uint32_to_float32"
            yield f"{key}/manifest", json.dumps({name: f"{matte_id(name):08x}" for name in names_of(scene, kind)})


def matte_id(name: str) -> int:
    """Returns the id of a name as the bits of a float, without denormals, infinities and NaN."""
    hashed = murmur3(name.encode())
    return hashed ^ (1 << 23) if (hashed >> 23) & 255 in {0, 255} else hashed


def murmur3(data: bytes) -> int:
    """Returns MurmurHash3 for 32 bits on x86 with seed 0 (Austin Appleby, public domain)."""

    def rotate(x: int, n: int) -> int:
        return (x << n | x >> (32 - n)) & 0xFFFFFFFF

    def scramble(k: int) -> int:
        return rotate(k * 0xCC9E2D51 & 0xFFFFFFFF, 15) * 0x1B873593 & 0xFFFFFFFF

    h = 0
    whole = len(data) // 4 * 4
    for i in range(0, whole, 4):
        h = (rotate(h ^ scramble(int.from_bytes(data[i : i + 4], "little")), 13) * 5 + 0xE6546B64) & 0xFFFFFFFF
    h ^= scramble(int.from_bytes(data[whole:], "little"))
    h ^= len(data)
    h = (h ^ h >> 16) * 0x85EBCA6B & 0xFFFFFFFF
    h = (h ^ h >> 13) * 0xC2B2AE35 & 0xFFFFFFFF
    return h ^ h >> 16
