"""Writers of PNG, glTF, GLB and OBJ in plain Python."""

import base64
import json
import struct
import zlib
from pathlib import Path

MODELS = Path(__file__).resolve().parent.parent


def folder(name):
    path = MODELS / name
    path.mkdir(parents=True, exist_ok=True)
    return path


def png(rows):
    """PNG bytes of rows of (r, g, b) or (r, g, b, a) bytes, top row first (nested lists or a u8 array)."""
    height, width, channels = len(rows), len(rows[0]), len(rows[0][0])

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    previous, raw = bytes(width * channels), []
    for row in rows:
        line = bytes(row.reshape(-1)) if hasattr(row, "reshape") else bytes(c for p in row for c in p)
        left = bytes(channels) + line[:-channels]
        candidates = [
            b"\0" + line,
            b"\1" + bytes((a - b) & 255 for a, b in zip(line, left)),
            b"\2" + bytes((a - b) & 255 for a, b in zip(line, previous)),
        ]
        raw.append(min(candidates, key=lambda c: sum(min(v, 256 - v) for v in c[1:])))
        previous = line
    head = struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(b"".join(raw), 9))
        + chunk(b"IEND", b"")
    )


def write(path, data):
    Path(path).write_bytes(data if isinstance(data, bytes) else data.encode())


class Gltf:
    """A glTF document and its one buffer."""

    def __init__(self):
        self.json = {"asset": {"version": "2.0", "generator": "blinn models"}, "scene": 0, "scenes": [{"nodes": []}]}
        self.buffer = b""

    def add(self, kind, item):
        """Appends to a top-level list and returns the index."""
        self.json.setdefault(kind, []).append(item)
        return len(self.json[kind]) - 1

    def view(self, data, target=None):
        self.buffer += bytes(-len(self.buffer) % 4)
        item = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data)}
        if target:
            item["target"] = target
        self.buffer += data
        return self.add("bufferViews", item)

    def floats(self, rows, bounds=False):
        """An f32 vector accessor of rows; `bounds` adds min and max, as POSITION needs."""
        width = len(rows[0])
        data = struct.pack(f"<{len(rows) * width}f", *(c for row in rows for c in row))
        item = {"bufferView": self.view(data, 34962), "componentType": 5126, "count": len(rows), "type": f"VEC{width}"}
        if bounds:
            values = list(struct.iter_unpack(f"<{width}f", data))
            item["min"] = [min(column) for column in zip(*values)]
            item["max"] = [max(column) for column in zip(*values)]
        return self.add("accessors", item)

    def indices(self, triangles):
        flat = [i for t in triangles for i in t]
        data = struct.pack(f"<{len(flat)}H", *flat)
        return self.add(
            "accessors",
            {"bufferView": self.view(data, 34963), "componentType": 5123, "count": len(flat), "type": "SCALAR"},
        )

    def mesh(self, name, shape, material=None, normals=None):
        """A one-primitive mesh; a Shape's own UVs are not used (its vertices are shared)."""
        primitive = {"attributes": {"POSITION": self.floats(shape.verts, bounds=True)}}
        if normals:
            primitive["attributes"]["NORMAL"] = self.floats(normals)
        primitive["indices"] = self.indices(shape.triangles())
        if material is not None:
            primitive["material"] = material
        return self.add("meshes", {"name": name, "primitives": [primitive]})

    def material(self, name, rgb, metallic=0.0, roughness=0.5):
        return self.add(
            "materials",
            {
                "name": name,
                "pbrMetallicRoughness": {
                    "baseColorFactor": [*rgb, 1],
                    "metallicFactor": metallic,
                    "roughnessFactor": roughness,
                },
            },
        )

    def light(self, **light):
        """A KHR_lights_punctual light; returns what a node's `extensions` must hold."""
        used = self.json.setdefault("extensionsUsed", [])
        if "KHR_lights_punctual" not in used:
            used.append("KHR_lights_punctual")
        lights = self.json.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})
        lights["lights"].append(light)
        return {"KHR_lights_punctual": {"light": len(lights["lights"]) - 1}}

    def node(self, name, parent=None, **node):
        index = self.add("nodes", {"name": name, **node})
        if parent is None:
            self.json["scenes"][0]["nodes"].append(index)
        else:
            self.json["nodes"][parent].setdefault("children", []).append(index)
        return index

    def document(self, uri=None):
        self.json["buffers"] = [{**({"uri": uri} if uri else {}), "byteLength": len(self.buffer)}]
        return self.json

    def write_glb(self, path):
        self.buffer += bytes(-len(self.buffer) % 4)
        text = json.dumps(self.document(), separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + len(self.buffer)
        write(
            path,
            struct.pack("<4sII", b"glTF", 2, total)
            + struct.pack("<I4s", len(text), b"JSON")
            + text
            + struct.pack("<I4s", len(self.buffer), b"BIN\0")
            + self.buffer,
        )

    def write_embedded(self, path):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.buffer).decode()
        write(path, json.dumps(self.document(uri), indent=2) + "\n")


def look_at(eye, direction, up=(0, 1, 0)):
    """The rotation (x, y, z, w) that turns −Z to the direction and +Y towards up."""

    def unit(a):
        n = sum(c * c for c in a) ** 0.5
        return tuple(c / n for c in a)

    def cross(a, b):
        return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])

    w = unit(tuple(-c for c in direction))
    u = unit(cross(up, w))
    v = cross(w, u)
    m = list(zip(u, v, w))  # rows of the matrix whose columns are u, v, w
    q = [0.0] * 4
    trace = m[0][0] + m[1][1] + m[2][2]
    if trace > 0:
        s = 2 * (trace + 1) ** 0.5
        q = [(m[2][1] - m[1][2]) / s, (m[0][2] - m[2][0]) / s, (m[1][0] - m[0][1]) / s, s / 4]
    else:
        i = max(range(3), key=lambda k: m[k][k])
        j, k = (i + 1) % 3, (i + 2) % 3
        s = 2 * (1 + m[i][i] - m[j][j] - m[k][k]) ** 0.5
        q[i], q[j], q[k] = s / 4, (m[j][i] + m[i][j]) / s, (m[k][i] + m[i][k]) / s
        q[3] = (m[k][j] - m[j][k]) / s
    return {"translation": list(eye), "rotation": q}


def obj_object(out, name, shape, material=None, offset=1, uv_offset=1):
    """Appends one `o` to the list of lines; returns the next indices of v and vt."""
    number = "{:.6g}".format
    out.append(f"o {name}")
    out += ["v " + " ".join(map(number, p)) for p in shape.verts]
    uv_index = {}
    if shape.uvs:
        for uv in (c for face in shape.uvs for c in face):
            if uv not in uv_index:
                uv_index[uv] = uv_offset + len(uv_index)
                out.append("vt " + " ".join(map(number, uv)))
    if material:
        out.append(f"usemtl {material}")
    for k, face in enumerate(shape.faces):
        if shape.uvs:
            out.append("f " + " ".join(f"{i + offset}/{uv_index[uv]}" for i, uv in zip(face, shape.uvs[k])))
        else:
            out.append("f " + " ".join(str(i + offset) for i in face))
    return offset + len(shape.verts), uv_offset + len(uv_index)
