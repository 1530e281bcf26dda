"""Writes meshes of arrays as a GLB file in memory, so that they take the way of every file."""

from __future__ import annotations

import json
import struct
import zlib
from dataclasses import dataclass
from typing import Any, Mapping

import numpy as np
import numpy.typing as npt

_FLOAT, _UINT = 5126, 5125


@dataclass
class Mesh:
    """A mesh of arrays; `blinn.Scene.from_arrays` documents them."""

    vertices: npt.ArrayLike
    faces: npt.ArrayLike
    normals: npt.ArrayLike | None = None
    uvs: npt.ArrayLike | None = None
    colors: npt.ArrayLike | None = None
    material: Mapping[str, Any] | None = None
    transforms: npt.ArrayLike | None = None
    name: str = "mesh"


class _Writer:
    """The JSON and the binary chunk of a GLB file."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "blinn arrays"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
            "materials": [],
            "textures": [],
            "images": [],
        }
        self.binary = bytearray()
        self.extensions: set[str] = set()

    def view(self, data: bytes) -> int:
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data
        return len(self.json["bufferViews"]) - 1

    def accessor(self, array: npt.NDArray[Any], component: int, shape: str, **more: Any) -> int:
        view = self.view(np.ascontiguousarray(array).tobytes())
        entry = {"bufferView": view, "componentType": component, "count": len(array), "type": shape, **more}
        self.json["accessors"].append(entry)
        return len(self.json["accessors"]) - 1

    def texture(self, image: npt.ArrayLike) -> dict[str, int]:
        view = self.view(_png(image))
        self.json["images"].append({"bufferView": view, "mimeType": "image/png"})
        self.json["textures"].append({"source": len(self.json["images"]) - 1})
        return {"index": len(self.json["textures"]) - 1}

    def bytes(self) -> bytes:
        root = {key: value for key, value in self.json.items() if value != []}
        if self.extensions:
            root["extensionsUsed"] = sorted(self.extensions)
        self.binary += b"\0" * (-len(self.binary) % 4)
        root["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(root).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + len(self.binary)
        return b"".join(
            [
                struct.pack("<4sII", b"glTF", 2, total),
                struct.pack("<I4s", len(text), b"JSON"),
                text,
                struct.pack("<I4s", len(self.binary), b"BIN\0"),
                bytes(self.binary),
            ]
        )


def write_glb(meshes: list[Mesh]) -> bytes:
    """Return a GLB file with the meshes."""
    writer = _Writer()
    for mesh in meshes:
        _write_mesh(writer, mesh)
    return writer.bytes()


def _write_mesh(writer: _Writer, mesh: Mesh) -> None:
    vertices = _rows(mesh.vertices, (3,), "vertices")
    faces = np.asarray(mesh.faces)
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise ValueError(f"faces must have shape (m, 3), not {faces.shape}; triangulate polygons first")
    if faces.size and (faces.min() < 0 or faces.max() >= len(vertices)):
        raise ValueError(f"faces must have indices from 0 to {len(vertices) - 1}")
    low, high = (vertices.min(0), vertices.max(0)) if len(vertices) else (np.zeros(3), np.zeros(3))
    attributes = {
        "POSITION": writer.accessor(
            vertices.astype("<f4"),
            _FLOAT,
            "VEC3",
            min=[float(x) for x in low.astype("f4")],
            max=[float(x) for x in high.astype("f4")],
        )
    }
    if mesh.normals is not None:
        normals = _rows(mesh.normals, (3,), "normals", len(vertices))
        attributes["NORMAL"] = writer.accessor(normals.astype("<f4"), _FLOAT, "VEC3")
    if mesh.uvs is not None:
        uvs = _rows(mesh.uvs, (2,), "uvs", len(vertices)).copy()
        uvs[:, 1] = 1.0 - uvs[:, 1]
        attributes["TEXCOORD_0"] = writer.accessor(uvs.astype("<f4"), _FLOAT, "VEC2")
    if mesh.colors is not None:
        colors = _linear_colors(mesh.colors, len(vertices))
        attributes["COLOR_0"] = writer.accessor(colors, _FLOAT, "VEC3" if colors.shape[1] == 3 else "VEC4")
    primitive = {
        "attributes": attributes,
        "indices": writer.accessor(faces.astype("<u4").ravel(), _UINT, "SCALAR"),
        "material": _write_material(writer, mesh.material or {}),
    }
    writer.json["meshes"].append({"name": mesh.name, "primitives": [primitive]})
    transforms = np.eye(4)[None] if mesh.transforms is None else np.asarray(mesh.transforms, np.float64)
    if transforms.ndim == 2:
        transforms = transforms[None]
    if transforms.shape[1:] != (4, 4) or not np.isfinite(transforms).all():
        raise ValueError(f"transforms must be finite and have shape (4, 4) or (k, 4, 4), not {transforms.shape}")
    for matrix in transforms:
        node: dict[str, Any] = {"name": mesh.name, "mesh": len(writer.json["meshes"]) - 1}
        if not np.array_equal(matrix, np.eye(4)):
            node["matrix"] = [float(x) for x in matrix.T.ravel()]
        writer.json["nodes"].append(node)
        writer.json["scenes"][0]["nodes"].append(len(writer.json["nodes"]) - 1)


def _write_material(writer: _Writer, material: Mapping[str, Any]) -> int:
    known = {
        "name", "base_color", "base_color_texture", "metallic", "roughness", "metallic_roughness_texture",
        "normal_texture", "occlusion_texture", "emissive", "emissive_texture", "alpha_mode", "alpha_cutoff",
        "double_sided", "ior", "transmission",
    }  # fmt: skip
    unknown = set(material) - known
    if unknown:
        raise ValueError(f"unknown material keys: {sorted(unknown)}; known are {sorted(known)}")
    color = [float(x) for x in np.asarray(material.get("base_color", (0.8, 0.8, 0.8)), np.float64).ravel()]
    if len(color) not in (3, 4):
        raise ValueError("base_color must have 3 or 4 numbers")
    pbr: dict[str, Any] = {
        "baseColorFactor": color + [1.0] * (4 - len(color)),
        "metallicFactor": float(material.get("metallic", 0.0)),
        "roughnessFactor": float(material.get("roughness", 0.6)),
    }
    entry: dict[str, Any] = {"pbrMetallicRoughness": pbr, "doubleSided": bool(material.get("double_sided", True))}
    if "name" in material:
        entry["name"] = str(material["name"])
    for key, place, name in [
        ("base_color_texture", pbr, "baseColorTexture"),
        ("metallic_roughness_texture", pbr, "metallicRoughnessTexture"),
        ("normal_texture", entry, "normalTexture"),
        ("occlusion_texture", entry, "occlusionTexture"),
        ("emissive_texture", entry, "emissiveTexture"),
    ]:
        if material.get(key) is not None:
            place[name] = writer.texture(material[key])
    if "emissive" in material:
        entry["emissiveFactor"] = [float(x) for x in material["emissive"]]
    elif "emissiveTexture" in entry:
        entry["emissiveFactor"] = [1.0, 1.0, 1.0]
    if "alpha_mode" in material:
        entry["alphaMode"] = str(material["alpha_mode"]).upper()
    elif len(color) == 4 and color[3] < 1.0:
        entry["alphaMode"] = "BLEND"
    if "alpha_cutoff" in material:
        entry["alphaCutoff"] = float(material["alpha_cutoff"])
    extensions = {}
    if "ior" in material:
        extensions["KHR_materials_ior"] = {"ior": float(material["ior"])}
    if "transmission" in material:
        extensions["KHR_materials_transmission"] = {"transmissionFactor": float(material["transmission"])}
    if extensions:
        entry["extensions"] = extensions
        writer.extensions.update(extensions)
    writer.json["materials"].append(entry)
    return len(writer.json["materials"]) - 1


def _rows(
    values: npt.ArrayLike, columns: tuple[int, ...], name: str, count: int | None = None
) -> npt.NDArray[np.float64]:
    """Return an array of shape (n, columns)."""
    array = np.asarray(values, np.float64)
    if array.ndim != 2 or array.shape[1] not in columns or (count is not None and len(array) != count):
        rows = "n" if count is None else str(count)
        expected = " or ".join(f"({rows}, {c})" for c in columns)
        raise ValueError(f"{name} must have shape {expected}, not {array.shape}")
    return array


def _linear_colors(values: npt.ArrayLike, count: int) -> npt.NDArray[np.float32]:
    """Return linear RGB or RGBA. Integers are sRGB."""
    raw = np.asarray(values)
    colors = _rows(raw, (3, 4), "colors", count)
    if raw.dtype.kind in "iu":
        encoded = colors / 255.0
        linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
        colors = np.concatenate([linear[:, :3], encoded[:, 3:]], axis=1)
    return colors.astype("<f4")


def _png(image: npt.ArrayLike) -> bytes:
    """Return a PNG of a uint8 array of shape (height, width[, 3 or 4])."""
    pixels = np.asarray(image)
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[:, :, None], 3, axis=2)
    if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] not in (3, 4):
        raise ValueError(
            f"images must be uint8 of shape (height, width, 3 or 4), not {pixels.dtype} of {pixels.shape}"
        )
    height, width, channels = pixels.shape
    rows = np.zeros((height, 1 + width * channels), np.uint8)
    rows[:, 1:] = pixels.reshape(height, width * channels)
    header = struct.pack(">IIBBBBB", width, height, 8, 6 if channels == 4 else 2, 0, 0, 0)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    signature = b"\x89PNG\r\n\x1a\n"
    compressed = zlib.compress(rows.tobytes(), 1)
    return signature + chunk(b"IHDR", header) + chunk(b"IDAT", compressed) + chunk(b"IEND", b"")
