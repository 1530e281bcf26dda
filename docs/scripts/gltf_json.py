"""Prints the JSON of glTF and GLB files, with the first elements of each accessor.

    python docs/scripts/gltf_json.py FILE… [KEY…]

Keys, such as materials or nodes, select parts of the document. Needs Python 3.9 or newer and nothing else.
"""

import base64
import json
import struct
import sys
from pathlib import Path

FORMATS = {5120: "b", 5121: "B", 5122: "h", 5123: "H", 5125: "I", 5126: "f"}
SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
SHOWN = 3


def read(path):
    """Returns the document and the bytes of each buffer."""
    data = path.read_bytes()
    chunk = b""
    if data[:4] == b"glTF":
        size = struct.unpack_from("<I", data, 12)[0]
        document, chunk = json.loads(data[20:20 + size]), data[28 + size:]
    else:
        document = json.loads(data)
    buffers = []
    for buffer in document.get("buffers", []):
        uri = buffer.get("uri")
        if uri is None:
            buffers.append(chunk)
        elif uri.startswith("data:"):
            buffers.append(base64.b64decode(uri.split(",", 1)[1]))
            buffer["uri"] = uri.split(",", 1)[0] + ",…"
        else:
            buffers.append((path.parent / uri).read_bytes() if (path.parent / uri).exists() else b"")
    return document, buffers


def first_elements(document, buffers, accessor):
    view = document.get("bufferViews", [])[accessor["bufferView"]]
    letter, size = FORMATS[accessor["componentType"]], SIZES[accessor["type"]]
    stride = view.get("byteStride") or size * struct.calcsize(letter)
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    elements = (
        struct.unpack_from(f"<{size}{letter}", buffers[view["buffer"]], start + i * stride)
        for i in range(min(accessor["count"], SHOWN))
    )
    return [[round(value, 4) for value in element] for element in elements]


def main():
    paths = [Path(name) for name in sys.argv[1:] if Path(name).exists()]
    keys = [name for name in sys.argv[1:] if not Path(name).exists()]
    for path in paths:
        document, buffers = read(path)
        for accessor in document.get("accessors", []):
            try:
                accessor["first"] = first_elements(document, buffers, accessor)
            except (KeyError, IndexError, struct.error) as error:
                accessor["first"] = f"unreadable: {error!r}"
        print(f"{path.name}: {document['asset'].get('generator')}")
        for key, value in document.items():
            if not keys or key in keys:
                for item in value if isinstance(value, list) else [value]:
                    print(f"  {key}: {json.dumps(item, ensure_ascii=False)}")


main()
