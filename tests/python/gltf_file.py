"""Builds the GLB files of tests: arrays become accessors, and everything else is the JSON of glTF."""

import json
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

COMPONENTS = {"uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
SQUARE = np.float32([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
CORNERS = np.uint32([0, 1, 2, 0, 2, 3])


def png(pixels: npt.NDArray[np.uint8]) -> bytes:
    """Returns a PNG of 3 or 4 channels of 8 bits."""
    height, width, channels = pixels.shape
    rows = np.zeros((height, 1 + width * channels), np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    signature = b"\x89PNG\r\n\x1a\n"
    return signature + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes())) + chunk(b"IEND", b"")


class Glb:
    """A GLB with a list of each kind of object, which `add` appends to."""

    def __init__(self, generator: str | None = None) -> None:
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}}
        if generator:
            self.json["asset"]["generator"] = generator
        self.data = bytearray()

    def add(self, kind: str, **members: Any) -> int:
        """Appends an object and returns its index."""
        objects = self.json.setdefault(kind, [])
        objects.append(members)
        for name in members.get("extensions", {}):
            self.use(name)
        return len(objects) - 1

    def use(self, extension: str) -> None:
        used = self.json.setdefault("extensionsUsed", [])
        if extension not in used:
            used.append(extension)

    def view(self, data: bytes) -> int:
        self.data += bytes(-len(self.data) % 4)
        self.data += data
        return self.add("bufferViews", buffer=0, byteOffset=len(self.data) - len(data), byteLength=len(data))

    def accessor(self, array: npt.ArrayLike, **members: Any) -> int:
        """Stores an array of a row per element; Python's numbers become float32."""
        array = np.ascontiguousarray(array)
        array = array if array.dtype.name in COMPONENTS else array.astype(np.float32)
        rows = array.reshape(len(array), -1)
        bounds = {"min": rows.min(0).tolist(), "max": rows.max(0).tolist()}
        kind, component = TYPES[rows.shape[1]], COMPONENTS[array.dtype.name]
        view = self.view(array.tobytes())
        return self.add(
            "accessors", bufferView=view, componentType=component, count=len(array), type=kind, **bounds, **members
        )

    def texture(self, png: bytes, **members: Any) -> int:
        image = self.add("images", bufferView=self.view(png), mimeType="image/png")
        return self.add("textures", source=image, **members)

    def mesh(
        self,
        positions: npt.ArrayLike = SQUARE,
        indices: npt.ArrayLike | None = CORNERS,
        *,
        material: int | None = None,
        **attributes: Any,
    ) -> int:
        """Adds a mesh of one primitive; attributes are arrays, or indices of accessors."""
        accessors = {"POSITION": self.accessor(np.float32(positions))}
        accessors |= {k: v if isinstance(v, int) else self.accessor(v) for k, v in attributes.items()}
        primitive: dict[str, Any] = {"attributes": accessors}
        if indices is not None:
            primitive["indices"] = self.accessor(np.asarray(indices, np.uint32).ravel())
        if material is not None:
            primitive["material"] = material
        return self.add("meshes", primitives=[primitive])

    def node(self, **members: Any) -> int:
        return self.add("nodes", **members)

    def animate(self, target: int | str, path: str, times: npt.ArrayLike, values: npt.ArrayLike, **sampler: Any) -> None:
        """Animates the path of a node, or what a JSON pointer points to."""
        if not self.json.get("animations"):
            self.add("animations", samplers=[], channels=[])
        animation = self.json["animations"][0]
        if isinstance(target, str):
            self.use("KHR_animation_pointer")
            goal = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": f"{target}/{path}"}}}
        else:
            goal = {"node": target, "path": path}
        channel = {"sampler": len(animation["samplers"]), "target": goal}
        inputs, outputs = self.accessor(np.float32(times)), self.accessor(np.float32(values))
        animation["samplers"].append({"input": inputs, "output": outputs, **sampler})
        animation["channels"].append(channel)

    def lights(self, *lights: dict[str, Any]) -> None:
        """Sets the punctual lights of the file."""
        self.use("KHR_lights_punctual")
        self.json.setdefault("extensions", {})["KHR_lights_punctual"] = {"lights": list(lights)}

    def light_node(self, light: int, **members: Any) -> int:
        return self.node(extensions={"KHR_lights_punctual": {"light": light}}, **members)

    def bytes(self, *roots: int) -> bytes:
        """Returns the file, whose scene has the given nodes."""
        document = self.json | {"scene": 0, "scenes": [{"nodes": list(roots)}]}
        data = bytes(self.data) + bytes(-len(self.data) % 4)
        document["buffers"] = [{"byteLength": len(data)}]
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
        return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks

    def save(self, path: Path, *roots: int) -> Path:
        path.write_bytes(self.bytes(*roots))
        return path
