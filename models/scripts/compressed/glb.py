"""A small glTF writer: plain Python, one buffer, one accessor per buffer view."""

import json
import struct
import sys
from pathlib import Path

# After this folder, which has modules of the same names.
sys.path.append(str(Path(__file__).resolve().parents[1]))
from files import png  # noqa: E402, F401

OUT = Path(__file__).resolve().parents[2] / "tests" / "gltf"
SIZE = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
CODE = {5120: "b", 5121: "B", 5122: "h", 5123: "H", 5125: "I", 5126: "f"}
F32, U8, I8, U16, I16, U32 = 5126, 5121, 5120, 5123, 5122, 5125


class Gltf:
    def __init__(self):
        self.json = {
            "asset": {"version": "2.0", "generator": "blinn test fixtures"},
            "scene": 0,
            "scenes": [{"nodes": []}],
        }
        self.buffer = b""

    def add(self, kind, item):
        self.json.setdefault(kind, []).append(item)
        return len(self.json[kind]) - 1

    def view(self, data, target=None, stride=None):
        self.buffer += bytes(-len(self.buffer) % 4)
        item = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data)}
        if stride:
            item["byteStride"] = stride
        if target:
            item["target"] = target
        self.buffer += data
        return self.add("bufferViews", item)

    def accessor(self, kind, rows, component=F32, normalized=False, bounds=False, target=None):
        """One accessor from a list of scalars or of rows; vertex rows are padded to 4 bytes."""
        width = SIZE[kind]
        rows = [(r,) if width == 1 and not isinstance(r, (tuple, list)) else tuple(r) for r in rows]
        assert all(len(r) == width for r in rows), kind
        code = CODE[component]
        packed = [struct.pack(f"<{width}{code}", *r) for r in rows]
        stride = None
        if target == 34962 and len(packed[0]) % 4:
            pad = bytes(-len(packed[0]) % 4)
            packed = [p + pad for p in packed]
            stride = len(packed[0])
        item = {
            "bufferView": self.view(b"".join(packed), target, stride),
            "componentType": component,
            "count": len(rows),
            "type": kind,
        }
        if normalized:
            item["normalized"] = True
        if bounds:
            values = [struct.unpack_from(f"<{width}{code}", p) for p in packed]
            item["min"] = [min(c) for c in zip(*values)]
            item["max"] = [max(c) for c in zip(*values)]
        return self.add("accessors", item)

    def attribute(self, kind, rows, component=F32, normalized=False, bounds=False):
        return self.accessor(kind, rows, component, normalized, bounds, 34962)

    def indices(self, flat, component=U16):
        return self.accessor("SCALAR", flat, component, target=34963)

    def node(self, name, parent=None, **node):
        index = self.add("nodes", {"name": name, **node})
        if parent is None:
            self.json["scenes"][0]["nodes"].append(index)
        else:
            self.json["nodes"][parent].setdefault("children", []).append(index)
        return index

    def material(self, name, rgba=(1, 1, 1, 1), metallic=0.0, roughness=0.5, **more):
        pbr = {"baseColorFactor": list(rgba), "metallicFactor": metallic, "roughnessFactor": roughness}
        return self.add("materials", {"name": name, "pbrMetallicRoughness": pbr, **more})

    def uses(self, name, required=False):
        for key in ["extensionsUsed"] + ["extensionsRequired"] * required:
            if name not in self.json.setdefault(key, []):
                self.json[key].append(name)

    def write(self, name):
        self.json["buffers"] = [{"byteLength": len(self.buffer)}] if self.buffer else []
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        body = self.buffer + bytes(-len(self.buffer) % 4)
        data = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + (8 + len(body) if body else 0))
        data += struct.pack("<I4s", len(text), b"JSON") + text
        if body:
            data += struct.pack("<I4s", len(body), b"BIN\0") + body
        OUT.mkdir(parents=True, exist_ok=True)
        (OUT / name).write_bytes(data)
