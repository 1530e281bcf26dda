"""Reads the GLB files of make_objects.py with numpy."""

import json
import struct

import numpy as np

WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}
TYPES = {5126: np.float32, 5125: np.uint32}


class Glb:
    """A file with its JSON."""

    def __init__(self, path):
        data = open(path, "rb").read()
        length = struct.unpack_from("<I", data, 12)[0]
        self.json, self.bytes = json.loads(data[20:20 + length]), data[28 + length:]

    def view(self, index):
        view = self.json["bufferViews"][index]
        return self.bytes[view["byteOffset"]:view["byteOffset"] + view["byteLength"]]

    def accessor(self, index):
        accessor = self.json["accessors"][index]
        array = np.frombuffer(self.view(accessor["bufferView"]), TYPES[accessor["componentType"]])
        return array.reshape(-1, WIDTHS[accessor["type"]])

    def image(self, texture):
        """The encoded image of a texture."""
        source = self.json["textures"][texture["index"]]["source"]
        return self.view(self.json["images"][source]["bufferView"])

    def primitives(self):
        """Positions, normals, texture coordinates, faces and material of each primitive."""
        for mesh in self.json["meshes"]:
            for primitive in mesh["primitives"]:
                arrays = [self.accessor(primitive["attributes"][name]) for name in ("POSITION", "NORMAL", "TEXCOORD_0")]
                yield *arrays, self.accessor(primitive["indices"]).reshape(-1, 3), primitive["material"]
