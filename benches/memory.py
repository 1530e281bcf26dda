"""Compares the memory that `--max-memory` has to allow with the peak of the process, for large scenes of each class:
`python3 benches/memory.py PROGRAM GENERATOR FOLDER [--only NAME,NAME] [--scale 2]`.

GENERATOR is blinn-scenes (`cargo build --release -p blinn-scenes`), FOLDER keeps the files that are generated. The
estimate is the least limit that lets a scene pass: limits begin with the size of the file and are raised to what each
error asks for. Prints a table in Markdown, in which estimates above 1 GiB are exact to 0.1 GiB. `--scale 4` makes scenes
of four times as many elements.
"""

import argparse
import json
import math
import re
import struct
import subprocess
import sys
import tempfile
import zlib
from array import array
from pathlib import Path

UNITS = {"bytes": 1, "KiB": 1 << 10, "MiB": 1 << 20, "GiB": 1 << 30}
FLOAT, UINT, USHORT, UBYTE = 5126, 5125, 5123, 5121
POINTS, LINES = 0, 1


def grid(side):
    """Returns the positions of a wavy square of `side` by `side` vertices, as a flat array."""
    out = array("f")
    for j in range(side):
        v = 2 * j / (side - 1) - 1
        for i in range(side):
            u = 2 * i / (side - 1) - 1
            out.extend((u, 0.1 * math.sin(9 * u) * math.cos(7 * v), v))
    return out


def grid_indices(side):
    out = array("I")
    for j in range(side - 1):
        for a in range(j * side, (j + 1) * side - 1):
            out.extend((a, a + side, a + 1, a + 1, a + side, a + side + 1))
    return out


def side_of(triangles):
    return math.isqrt(triangles // 2) + 1


def write_glb(path, attributes, indices=None, mode=4, images=(), **rest):
    """Writes a GLB of one mesh. `attributes` are (name, type, component type, array); `rest` goes to the top of the
    JSON, where `accessors` are further arrays of the same form."""
    blobs, views, accessors = [], [], []
    sizes = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}

    def add_view(data):
        views.append({"buffer": 0, "byteOffset": sum(map(len, blobs)), "byteLength": len(data)})
        blobs.append(data + b"\0" * (-len(data) % 4))
        return len(views) - 1

    def add(kind, component, values):
        accessor = {"bufferView": add_view(values.tobytes()), "componentType": component, "type": kind,
                    "count": len(values) // sizes[kind]}
        accessors.append(accessor)
        if component == FLOAT and kind in ("VEC3", "SCALAR"):
            parts = [values[i::sizes[kind]] for i in range(sizes[kind])]
            accessor["min"], accessor["max"] = [min(p) for p in parts], [max(p) for p in parts]
        return len(accessors) - 1

    primitive = {"attributes": {}, "mode": mode, "material": 0}
    for name, kind, component, values in attributes:
        primitive["attributes"][name] = add(kind, component, values)
    if indices is not None:
        primitive["indices"] = add("SCALAR", UINT, indices)
    for target in rest.pop("targets", []):
        primitive.setdefault("targets", []).append({"POSITION": add("VEC3", FLOAT, target)})
    for further in rest.pop("accessors", []):
        add(*further)
    document = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}], "materials": [{}],
    }
    if images:
        document["images"] = [{"bufferView": add_view(image), "mimeType": "image/png"} for image in images]
        document["textures"] = [{"source": i} for i in range(len(images))]
    document |= {"accessors": accessors, "bufferViews": views, **rest}
    binary = b"".join(blobs)
    document["buffers"] = [{"byteLength": len(binary)}]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    with path.open("wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary)))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", len(binary), b"BIN\0"))
        file.write(binary)


def png(side, seed):
    """Returns a square RGB picture as PNG."""
    rows = [bytes((x * (seed + 3) + y * y) // 7 & 255 for x in range(3 * side)) for y in range(64)]
    data = b"".join(b"\0" + rows[y % 64] for y in range(side))

    def chunk(name, body):
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    header = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(data, 1)) +
            chunk(b"IEND", b""))


def textured(path, triangles, map_names=("baseColorTexture", "metallicRoughnessTexture")):
    """Writes a mesh with four maps of 4096 x 4096 pixels, one of them a normal map."""
    side = side_of(triangles)
    positions = grid(side)
    uvs = array("f")
    for i in range(0, len(positions), 3):
        uvs.extend((positions[i] / 2 + 0.5, positions[i + 2] / 2 + 0.5))
    material = {"pbrMetallicRoughness": {name: {"index": i} for i, name in enumerate(map_names)},
                "normalTexture": {"index": 2}, "occlusionTexture": {"index": 3}}
    write_glb(path, [("POSITION", "VEC3", FLOAT, positions), ("TEXCOORD_0", "VEC2", FLOAT, uvs)], grid_indices(side),
              images=[png(4096, seed) for seed in range(4)], materials=[material])


def clip(path_name, node):
    """Returns the JSON of an animation of a node's `path_name`, from accessors -2 and -1."""
    return lambda inputs, outputs: {"animations": [{
        "channels": [{"sampler": 0, "target": {"node": node, "path": path_name}}],
        "samplers": [{"input": inputs, "output": outputs}]}]}


def skinned(path, triangles):
    """Writes a mesh with four influences of two joints for each vertex, one of which turns."""
    side = side_of(triangles)
    positions = grid(side)
    count = len(positions) // 3
    joints = array("B", (0, 1, 0, 0)) * count
    weights = array("f")
    for x in positions[::3]:
        weights.extend((0.5 - x / 2, 0.5 + x / 2, 0, 0))
    identity = array("f", [float(i % 5 == 0) for i in range(16)])
    attributes = [("POSITION", "VEC3", FLOAT, positions), ("JOINTS_0", "VEC4", UBYTE, joints),
                  ("WEIGHTS_0", "VEC4", FLOAT, weights)]
    accessors = [("MAT4", FLOAT, identity * 2), ("SCALAR", FLOAT, array("f", (0, 1))),
                 ("VEC3", FLOAT, array("f", (0, 0, 0, 0, 1, 0)))]
    write_glb(path, attributes, grid_indices(side), accessors=accessors,
              scenes=[{"nodes": [0, 1, 2]}], nodes=[{"mesh": 0, "skin": 0}, {}, {}],
              skins=[{"joints": [1, 2], "inverseBindMatrices": 4}], **clip("translation", 2)(5, 6))


def morphed(path, triangles):
    """Writes a mesh with two morph targets, whose weights are animated."""
    side = side_of(triangles)
    positions = grid(side)
    targets = [array("f", (0.1 * x for x in positions)), array("f", (-0.2 * x for x in positions))]
    accessors = [("SCALAR", FLOAT, array("f", (0, 1))), ("SCALAR", FLOAT, array("f", (0, 0, 1, 1)))]
    write_glb(path, [("POSITION", "VEC3", FLOAT, positions)], grid_indices(side), targets=targets,
              accessors=accessors, **clip("weights", 0)(4, 5))


def rounds(mode):
    """Returns a writer of a GLB of points, or of lines between every two vertices."""
    def write(path, elements):
        positions = grid(math.isqrt(elements * (1 + mode)))
        colors = array("B", (200, 100, 50, 255)) * (len(positions) // 3)
        attributes = [("POSITION", "VEC3", FLOAT, positions)]
        if mode == LINES:
            positions = positions[:len(positions) // 6 * 6]
            attributes = [("POSITION", "VEC3", FLOAT, positions)]
        else:
            attributes.append(("COLOR_0", "VEC4", UBYTE, colors))
        write_glb(path, attributes, mode=mode)
    return write


def facets(triangles):
    """Returns the corners of each triangle of a grid, as nine numbers."""
    side = side_of(triangles)
    positions, indices = grid(side), grid_indices(side)
    for t in range(0, len(indices), 3):
        yield [x for i in indices[t:t + 3] for x in positions[3 * i:3 * i + 3]]


def stl(path, triangles):
    count = 2 * (side_of(triangles) - 1) ** 2
    pack = struct.Struct("<12fH").pack
    with path.open("wb") as file:
        file.write(b" " * 80 + struct.pack("<I", count))
        file.writelines(pack(0, 1, 0, *facet, 0) for facet in facets(triangles))


def stl_text(path, triangles):
    with path.open("w") as file:
        file.write("solid grid\n")
        form = ("facet normal 0 1 0\nouter loop\nvertex %.6g %.6g %.6g\nvertex %.6g %.6g %.6g\nvertex %.6g %.6g %.6g\n"
                "endloop\nendfacet\n")
        file.writelines(form % tuple(facet) for facet in facets(triangles))
        file.write("endsolid grid\n")


def ply_header(path, encoding, vertices, faces, properties=()):
    names = "".join(f"property {kind} {name}\n" for kind, name in properties)
    elements = f"element face {faces}\nproperty list uchar int vertex_indices\n" if faces else ""
    file = path.open("wb")
    file.write(f"ply\nformat {encoding} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n"
               f"property float z\n{names}{elements}end_header\n".encode())
    return file


def ply(path, triangles):
    side = side_of(triangles)
    indices, pack = grid_indices(side), struct.Struct("<B3I").pack
    with ply_header(path, "binary_little_endian", side * side, len(indices) // 3) as file:
        file.write(grid(side).tobytes())
        file.writelines(pack(3, *indices[t:t + 3]) for t in range(0, len(indices), 3))


def ply_text(path, triangles):
    side = side_of(triangles)
    positions, indices = grid(side), grid_indices(side)
    with ply_header(path, "ascii", side * side, len(indices) // 3) as file:
        file.writelines(b"%.6g %.6g %.6g\n" % tuple(positions[i:i + 3]) for i in range(0, len(positions), 3))
        file.writelines(b"3 %d %d %d\n" % tuple(indices[t:t + 3]) for t in range(0, len(indices), 3))


def ply_points(path, points):
    side = math.isqrt(points)
    positions, pack = grid(side), struct.Struct("<3f3B").pack
    colors = [("uchar", name) for name in ("red", "green", "blue")]
    with ply_header(path, "binary_little_endian", side * side, 0, colors) as file:
        file.writelines(pack(*positions[i:i + 3], 200, 100, 50) for i in range(0, len(positions), 3))


def obj_lines(path, lines):
    side = math.isqrt(lines)
    positions = grid(side)
    with path.open("w") as file:
        file.writelines("v %.6g %.6g %.6g\n" % tuple(positions[i:i + 3]) for i in range(0, len(positions), 3))
        for j in range(side):
            file.write("l " + " ".join(str(j * side + i + 1) for i in range(side)) + "\n")


def metals(path, triangles):
    """Writes a mesh of a rough metal."""
    side = side_of(triangles)
    metal = {"pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0.4}}
    write_glb(path, [("POSITION", "VEC3", FLOAT, grid(side))], grid_indices(side), materials=[metal])


def below_map(path, triangles):
    """Writes a mesh, and a map of 8192 x 4096 pixels beside it."""
    side = side_of(triangles)
    write_glb(path, [("POSITION", "VEC3", FLOAT, grid(side))], grid_indices(side))
    width, height = 8192, 4096
    # Without compression.
    rows = [b"".join(bytes(((x * y) % 251, (x + 3 * y) % 200, 90, 128)) for x in range(width)) for y in range(16)]
    with (path.parent / MAP).open("wb") as file:
        file.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width))
        file.writelines(rows[y % 16] for y in range(height))


def generated(kind, *flags):
    """Returns a writer that runs the generator."""
    def write(path, triangles):
        command = [arguments.generator.resolve(), kind, str(triangles), path, *flags]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return write


PICTURE = "--size 640x360"
MAP = "map.hdr"
LAYERS = "--size 3840x2160 --aov depth,normal,position,albedo,uv,mask,object-id,cryptomatte"
MILLION = 1_000_000
# Name: ending, elements, writer, options.
CLASSES = {
    "scan-glb": ("glb", 2 * MILLION, generated("scan"), PICTURE),
    "scan-obj": ("obj", 2 * MILLION, generated("scan"), PICTURE),
    "scan-textured": ("glb", 2 * MILLION, generated("scan", "--textured"), PICTURE),
    "soup-glb": ("glb", 2 * MILLION, generated("soup"), PICTURE),
    "soup-obj": ("obj", 2 * MILLION, generated("soup"), PICTURE),
    "interior-glb": ("glb", 2 * MILLION, generated("interior"), PICTURE),
    "interior-obj": ("obj", 2 * MILLION, generated("interior"), PICTURE),
    "instances": ("glb", 8 * MILLION, generated("forest"), PICTURE),
    "textured": ("glb", MILLION // 2, textured, PICTURE),
    "skinned": ("glb", MILLION, skinned, PICTURE + " --frames=1-4"),
    "skinned-still": ("glb", MILLION, skinned, PICTURE),
    "morphed": ("glb", MILLION, morphed, PICTURE + " --frames=1-4"),
    "points-glb": ("glb", 4 * MILLION, rounds(POINTS), PICTURE),
    "points-ply": ("ply", 4 * MILLION, ply_points, PICTURE),
    "lines-glb": ("glb", 2 * MILLION, rounds(LINES), PICTURE),
    "lines-obj": ("obj", 2 * MILLION, obj_lines, PICTURE),
    "stl": ("stl", 2 * MILLION, stl, PICTURE),
    "stl-text": ("stl", MILLION, stl_text, PICTURE),
    "ply": ("ply", 2 * MILLION, ply, PICTURE),
    "ply-text": ("ply", 2 * MILLION, ply_text, PICTURE),
    "edges": ("glb", MILLION // 2, generated("scan"), PICTURE + " --edges all"),
    "slivers": ("glb", MILLION, generated("slivers"), PICTURE),
    "stadium": ("glb", MILLION, generated("stadium"), PICTURE),
    "coincident": ("glb", MILLION, generated("layers"), PICTURE),
    "exr-layers": ("glb", 10_000, generated("interior"), LAYERS),
    "exr-mattes": ("glb", 10_000, generated("interior"),
                   "--size 3840x2160 --aov depth,normal,object-id,cryptomatte"),
    "map": ("glb", MILLION, below_map, PICTURE + " --hdri {folder}/" + MAP),
    "bounced": ("glb", 10_000, generated("interior"), "--size 1920x1080 -s 2 --indirect 1"),
    "bounced-off": ("glb", 10_000, generated("interior"), "--size 1920x1080 -s 2 --indirect 1 --denoise off"),
    "bounced-layers": ("glb", 10_000, generated("interior"),
                       "--size 1920x1080 -s 2 --indirect 1 --aov diffuse-direct,diffuse-indirect"),
    "lens": ("glb", 10_000, generated("interior"), "--size 1920x1080 -s 2 --aperture-radius 0.05"),
    "metals": ("glb", 10_000, metals, "--size 1920x1080 -s 2"),
    "png-4k": ("glb", 10_000, generated("interior"), "--size 3840x2160"),
}


def render(scene, options, allowed):
    """Renders a scene. Returns the bytes that the error asks for, and the peak."""
    with tempfile.TemporaryDirectory() as folder:
        ending = "exr" if "--aov" in options else "png"
        options = options.format(folder=arguments.folder.resolve()).split()
        samples = [] if "-s" in options else ["-s", "1"]
        command = [arguments.program.resolve(), "render", scene, "-o", f"{folder}/{{index}}.{ending}", *samples,
                   "--perf", "--max-memory", str(allowed), *options]
        run = subprocess.run(command, capture_output=True, text=True)
    number = r"([\d.]+) (bytes|KiB|MiB|GiB)"
    if run.returncode == 0:
        value, unit = re.search(rf"perf: memory\s+{number}", run.stderr).groups()
        return None, float(value) * UNITS[unit]
    asked = re.search(r"(\d+) exceeds the limit", run.stderr)
    if asked:
        return int(asked[1]), None
    asked = re.search(rf"needs about {number}", run.stderr)
    if not asked:
        sys.exit(f"{scene}: {run.stderr}")
    # The number is rounded.
    return math.ceil((float(asked[1]) + 0.05) * UNITS[asked[2]]), None


def measure(name):
    ending, elements, write, options = CLASSES[name]
    elements = round(elements * arguments.scale)
    scene = arguments.folder / f"{name.removesuffix('-still')}-{elements}.{ending}"
    if not scene.exists():
        write(scene, elements)
    allowed = scene.stat().st_size
    while True:
        asked, peak = render(scene, options, allowed)
        if asked is None:
            break
        allowed = max(asked, allowed + 1)
    print(f"| {name} | {elements:,} | {scene.stat().st_size / 1e6:.0f} | {allowed / 1e6:.0f} | {peak / 1e6:.0f} "
          f"| {peak / elements:.0f} | {allowed / peak:.2f} |", flush=True)


parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("program", type=Path)
parser.add_argument("generator", type=Path)
parser.add_argument("folder", type=Path)
parser.add_argument("--only", default=",".join(CLASSES))
parser.add_argument("--scale", type=float, default=1)
arguments = parser.parse_args()
arguments.folder.mkdir(parents=True, exist_ok=True)
print("| class | elements | file, MB | estimate, MB | peak, MB | bytes per element | estimate to peak |\n"
      "|---|---|---|---|---|---|---|")
for each in arguments.only.split(","):
    measure(each)
