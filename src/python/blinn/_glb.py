"""Writes meshes of arrays as a GLB file in memory, so that they take the way of every file."""

from __future__ import annotations

import json
import struct
import zlib
from dataclasses import dataclass
from typing import Any, Mapping, Sequence

import numpy as np
import numpy.typing as npt

_FLOAT, _UINT = 5126, 5125
# What is farther from the origin than so many times its size is moved to it: single precision would round its shape.
_FAR = 4.0
# Largest number that computations leave where 0 or 1 is exact.
_NEGLIGIBLE = 1e-6


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


@dataclass
class _MeshArrays:
    """The arrays of a mesh as a file has them."""

    positions: npt.NDArray[np.float32]
    """Relative to `centre`."""
    faces: npt.NDArray[np.uint32]
    normals: npt.NDArray[np.float32] | None
    uvs: npt.NDArray[np.float32] | None
    colors: npt.NDArray[np.float32] | None
    centre: npt.NDArray[np.float64]
    radius: float
    """Half of the longest side of the bounds."""


class Writer:
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
            "cameras": [],
        }
        self.binary = bytearray()
        self._textures: dict[int, tuple[Any, int]] = {}
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
        """Add a texture. An array that several materials share is written once."""
        if id(image) not in self._textures:
            view = self.view(_png(image))
            self.json["images"].append({"bufferView": view, "mimeType": "image/png"})
            self.json["textures"].append({"source": len(self.json["images"]) - 1})
            # The array is kept, so that no other one has its identity.
            self._textures[id(image)] = (image, len(self.json["textures"]) - 1)
        return {"index": self._textures[id(image)][1]}

    def mesh(self, mesh: Mesh, node_names: Sequence[str] | None = None) -> None:
        """Add a mesh with a node for each of its transforms."""
        arrays = _mesh_arrays(mesh)
        finite = arrays.positions[np.isfinite(arrays.positions).all(1)]
        low, high = (finite.min(0), finite.max(0)) if len(finite) else (np.zeros(3), np.zeros(3))
        bounds = {"min": [float(x) for x in low], "max": [float(x) for x in high]}
        attributes = {"POSITION": self.accessor(arrays.positions, _FLOAT, "VEC3", **bounds)}
        if arrays.normals is not None:
            attributes["NORMAL"] = self.accessor(arrays.normals, _FLOAT, "VEC3")
        if arrays.uvs is not None:
            attributes["TEXCOORD_0"] = self.accessor(arrays.uvs, _FLOAT, "VEC2")
        if arrays.colors is not None:
            shape = "VEC3" if arrays.colors.shape[1] == 3 else "VEC4"
            attributes["COLOR_0"] = self.accessor(arrays.colors, _FLOAT, shape)
        primitive = {
            "attributes": attributes,
            "indices": self.accessor(arrays.faces.ravel(), _UINT, "SCALAR"),
            "material": _write_material(self, mesh.material or {}, arrays.colors),
        }
        self.json["meshes"].append({"name": mesh.name, "primitives": [primitive]})
        index = len(self.json["meshes"]) - 1
        for i, matrix in enumerate(_placements(mesh)):
            node = {"name": node_names[i] if node_names else mesh.name, "mesh": index}
            self.place(node, matrix, arrays.centre, arrays.radius)

    def place(
        self,
        node: dict[str, Any],
        matrix: npt.NDArray[np.float64],
        centre: npt.ArrayLike = (0, 0, 0),
        size: float = 0.0,
    ) -> None:
        """Add a node with a transform of an object around `centre` that has about `size`.

        A file has single precision. Of a translation that is far beyond the size, a parent has the large part, and the
        node what is left.
        """
        matrix = matrix.copy()
        matrix[:3, 3] += matrix[:3, :3] @ np.asarray(centre, np.float64)
        matrix[3] = [0, 0, 0, 1]
        far = np.zeros(3)
        if np.abs(matrix[:3, 3]).max() > _FAR * size * np.abs(matrix[:3, :3]).max():
            with np.errstate(over="ignore"):
                far = matrix[:3, 3].astype("f4").astype(np.float64)
            matrix[:3, 3] -= far
        if not np.array_equal(matrix, np.eye(4)):
            node["matrix"] = [float(x) for x in matrix.T.ravel()]
        elif far.any():
            node["translation"] = [float(x) for x in far]
            far = np.zeros(3)
        self.json["nodes"].append(node)
        if far.any():
            child = len(self.json["nodes"]) - 1
            self.json["nodes"].append({"translation": [float(x) for x in far], "children": [child]})
        self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]) - 1)

    def camera(self, matrix: npt.NDArray[np.float64], perspective: Mapping[str, float], name: str) -> None:
        """Add a perspective camera with the properties of glTF."""
        self.json["cameras"].append({"name": name, "type": "perspective", "perspective": dict(perspective)})
        self.place({"name": name, "camera": len(self.json["cameras"]) - 1}, matrix)

    def bytes(self) -> bytes:
        root = {key: value for key, value in self.json.items() if value != []}
        if self.extensions:
            root["extensionsUsed"] = sorted(self.extensions)
        self.binary += b"\0" * (-len(self.binary) % 4)
        root["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(root, allow_nan=False).encode()
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
    writer = Writer()
    for mesh in meshes:
        writer.mesh(mesh)
    return writer.bytes()


def _mesh_arrays(mesh: Mesh) -> _MeshArrays:
    """Check the arrays of a mesh, and move its vertices to the origin if they are far from it."""
    vertices = _rows(mesh.vertices, (3,), "vertices")
    finite = vertices[np.isfinite(vertices).all(1)]
    low, high = (finite.min(0), finite.max(0)) if len(finite) else (np.zeros(3), np.zeros(3))
    centre, half = 0.5 * low + 0.5 * high, 0.5 * high - 0.5 * low
    if np.abs(centre).max() <= _FAR * half.max():
        centre = np.zeros(3)
    with np.errstate(over="ignore", invalid="ignore"):
        positions = (vertices - centre).astype("<f4")
    normals = None if mesh.normals is None else _rows(mesh.normals, (3,), "normals", len(vertices)).astype("<f4")
    uvs = None
    if mesh.uvs is not None:
        # Rows of a texture count from the top.
        uvs = (_rows(mesh.uvs, (2,), "uvs", len(vertices)) * [1, -1] + [0, 1]).astype("<f4")
    colors = None if mesh.colors is None else _linear_colors(mesh.colors, len(vertices))
    return _MeshArrays(positions, _indices(mesh.faces, len(vertices)), normals, uvs, colors, centre, float(half.max()))


def _indices(faces: npt.ArrayLike, count: int) -> npt.NDArray[np.uint32]:
    """Return the corners of triangles as indices of vertices."""
    array = np.asarray(faces)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"faces must have shape (m, 3), not {array.shape}; triangulate polygons first")
    is_integer = array.dtype.kind in "iu" or array.dtype.kind == "f" and bool((array == np.floor(array)).all())
    if array.size and not is_integer:
        raise ValueError(f"faces must be integers, the indices of vertices, not {array.dtype} with fractions")
    if array.size and (array.min() < 0 or array.max() >= count):
        raise ValueError(f"faces must have indices from 0 to {count - 1}")
    return array.astype("<u4")


def _placements(mesh: Mesh) -> npt.NDArray[np.float64]:
    """Return the matrices that place a mesh."""
    given = np.eye(4) if mesh.transforms is None else np.asarray(mesh.transforms, np.float64)
    transforms = given[None] if given.ndim == 2 else given
    if transforms.shape[1:] != (4, 4):
        raise ValueError(f"transforms must have shape (4, 4) or (k, 4, 4), not {given.shape}")
    if not np.isfinite(transforms).all():
        raise ValueError("transforms must be finite, without NaN and infinity")
    if transforms.size and np.abs(transforms[:, 3] - [0, 0, 0, 1]).max() > _NEGLIGIBLE:
        raise ValueError("transforms must have the last row 0, 0, 0, 1; are they transposed?")
    return transforms


def _write_material(
    writer: Writer, material: Mapping[str, Any], colors: npt.NDArray[np.float32] | None
) -> int:
    known = {
        "name", "base_color", "base_color_texture", "metallic", "roughness", "metallic_roughness_texture",
        "normal_texture", "occlusion_texture", "emissive", "emissive_texture", "alpha_mode", "alpha_cutoff",
        "double_sided", "ior", "transmission", "clearcoat", "clearcoat_roughness", "clearcoat_normal_texture",
        "sheen_color", "sheen_roughness", "anisotropy", "anisotropy_rotation",
        "iridescence", "iridescence_ior", "iridescence_thickness",
        "thickness", "attenuation_color", "attenuation_distance", "dispersion", "diffuse_transmission",
        "diffuse_transmission_color", "specular", "specular_color", "emissive_strength",
    }  # fmt: skip
    unknown = set(material) - known
    if unknown:
        raise ValueError(f"unknown material keys: {sorted(unknown)}; known are {sorted(known)}")
    # Beside a texture or colours of vertices, a factor of 1 shows them as they are.
    texture = material.get("base_color_texture")
    is_colored = texture is not None or colors is not None
    is_mapped = material.get("metallic_roughness_texture") is not None
    color = _numbers(material, "base_color", (1.0,) * 3 if is_colored else (0.8,) * 3)
    if len(color) not in (3, 4):
        raise ValueError("base_color must have 3 or 4 numbers")
    pbr: dict[str, Any] = {
        "baseColorFactor": color + [1.0] * (4 - len(color)),
        "metallicFactor": _number(material, "metallic", 1.0 if is_mapped else 0.0),
        "roughnessFactor": _number(material, "roughness", 1.0 if is_mapped else 0.6),
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
    extensions: dict[str, dict[str, Any]] = {}
    if "emissive" in material:
        emissive = _numbers(material, "emissive", ())
        # Factors of glTF end at 1.
        strength = max([1.0, *emissive])
        entry["emissiveFactor"] = [value / strength for value in emissive]
        if strength > 1.0:
            extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
    elif "emissiveTexture" in entry:
        entry["emissiveFactor"] = [1.0, 1.0, 1.0]
    if "alpha_mode" in material:
        entry["alphaMode"] = str(material["alpha_mode"]).upper()
    elif len(color) == 4 and color[3] < 1.0 or _has_alpha(colors) or _has_alpha(texture):
        entry["alphaMode"] = "BLEND"
    if "alpha_cutoff" in material:
        entry["alphaCutoff"] = _number(material, "alpha_cutoff", 0.5)
    for key, extension, factor in [
        ("clearcoat", "KHR_materials_clearcoat", "clearcoatFactor"),
        ("clearcoat_roughness", "KHR_materials_clearcoat", "clearcoatRoughnessFactor"),
        ("sheen_roughness", "KHR_materials_sheen", "sheenRoughnessFactor"),
        ("anisotropy", "KHR_materials_anisotropy", "anisotropyStrength"),
        ("anisotropy_rotation", "KHR_materials_anisotropy", "anisotropyRotation"),
        ("thickness", "KHR_materials_volume", "thicknessFactor"),
        ("attenuation_distance", "KHR_materials_volume", "attenuationDistance"),
        ("specular", "KHR_materials_specular", "specularFactor"),
        ("emissive_strength", "KHR_materials_emissive_strength", "emissiveStrength"),
        ("dispersion", "KHR_materials_dispersion", "dispersion"),
        ("diffuse_transmission", "KHR_materials_diffuse_transmission", "diffuseTransmissionFactor"),
        ("iridescence", "KHR_materials_iridescence", "iridescenceFactor"),
        ("iridescence_ior", "KHR_materials_iridescence", "iridescenceIor"),
        ("iridescence_thickness", "KHR_materials_iridescence", "iridescenceThicknessMaximum"),
    ]:
        if key in material:
            extensions.setdefault(extension, {})[factor] = _number(material, key, 0.0)
    for key, extension, factor in [
        ("sheen_color", "KHR_materials_sheen", "sheenColorFactor"),
        ("attenuation_color", "KHR_materials_volume", "attenuationColor"),
        ("specular_color", "KHR_materials_specular", "specularColorFactor"),
        ("diffuse_transmission_color", "KHR_materials_diffuse_transmission", "diffuseTransmissionColorFactor"),
    ]:
        if key in material:
            extensions.setdefault(extension, {})[factor] = _numbers(material, key, ())
    if material.get("clearcoat_normal_texture") is not None:
        coat = extensions.setdefault("KHR_materials_clearcoat", {})
        coat["clearcoatNormalTexture"] = writer.texture(material["clearcoat_normal_texture"])
    if "ior" in material:
        extensions["KHR_materials_ior"] = {"ior": _number(material, "ior", 1.5)}
    if "transmission" in material:
        extensions["KHR_materials_transmission"] = {"transmissionFactor": _number(material, "transmission", 0.0)}
    if extensions:
        entry["extensions"] = extensions
        writer.extensions.update(extensions)
    writer.json["materials"].append(entry)
    return len(writer.json["materials"]) - 1


def _number(material: Mapping[str, Any], key: str, default: float) -> float:
    """Return a finite number of a material."""
    value = float(material.get(key, default))
    if not np.isfinite(value):
        raise ValueError(f"{key} must be finite, not {value}")
    return value


def _numbers(material: Mapping[str, Any], key: str, default: Sequence[float]) -> list[float]:
    """Return the finite numbers of a colour of a material."""
    values = np.asarray(material.get(key, default), np.float64).ravel()
    if not np.isfinite(values).all():
        raise ValueError(f"{key} must be finite, not {values.tolist()}")
    return [float(value) for value in values]


def _has_alpha(colors: npt.ArrayLike | None) -> bool:
    """Tell whether colours, or the texels of an image, are translucent somewhere."""
    if colors is None:
        return False
    values = np.asarray(colors)
    if values.ndim == 0 or values.shape[-1] != 4:
        return False
    opaque = np.iinfo(values.dtype).max if values.dtype.kind in "iu" else 1.0
    return bool((values[..., 3] < opaque).any())


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
    """Return linear RGB or RGBA. Integers are sRGB: up to 65535 in uint16, else up to 255."""
    raw = np.asarray(values)
    if raw.dtype.kind not in "iuf":
        raise ValueError(f"colors must be integers or floats, not {raw.dtype}")
    colors = _rows(raw, (3, 4), "colors", count)
    if raw.dtype.kind in "iu":
        largest = 65535.0 if raw.dtype.newbyteorder("=") == np.uint16 else 255.0
        if colors.size and (colors.min() < 0 or colors.max() > largest):
            raise ValueError("integer colors must be from 0 to 255, or uint16 from 0 to 65535")
        encoded = colors / largest
        linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
        colors = np.concatenate([linear[:, :3], encoded[:, 3:]], axis=1)
    return colors.astype("<f4")


def _png(image: npt.ArrayLike) -> bytes:
    """Return a PNG of a uint8 or uint16 array of shape (height, width[, 3 or 4])."""
    pixels = np.asarray(image)
    # Arrays of files may have the bytes of another machine.
    pixels = pixels.astype(pixels.dtype.newbyteorder("="), copy=False)
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[:, :, None], 3, axis=2)
    if pixels.dtype not in (np.uint8, np.uint16) or pixels.ndim != 3 or pixels.shape[2] not in (3, 4):
        raise ValueError(
            f"images must be uint8 or uint16 of shape (height, width, 3 or 4), not {pixels.dtype} of {pixels.shape}"
        )
    height, width, channels = pixels.shape
    depth = pixels.dtype.itemsize
    # PNG has the high byte first.
    samples = np.ascontiguousarray(pixels, pixels.dtype.newbyteorder(">")).view(np.uint8)
    rows = np.zeros((height, 1 + width * channels * depth), np.uint8)
    rows[:, 1:] = samples.reshape(height, width * channels * depth)
    header = struct.pack(">IIBBBBB", width, height, 8 * depth, 6 if channels == 4 else 2, 0, 0, 0)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    signature = b"\x89PNG\r\n\x1a\n"
    compressed = zlib.compress(rows.tobytes(), 1)
    return signature + chunk(b"IHDR", header) + chunk(b"IDAT", compressed) + chunk(b"IEND", b"")
