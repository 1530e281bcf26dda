"""Writes the three small scenes of Blender's references, models/tests/references/. Plain Python, no Blender.

wrap.gltf     nine boards: the wrap modes in both directions, KHR_texture_transform, a second UV set, alpha MASK
motion.gltf   STEP, LINEAR and CUBICSPLINE on nodes in a hierarchy, a matrix node, a mirrored node, a sheared child
groups.obj    n-gons (concave ones too), smoothing groups, negative indices, `\\` line ends, map_Kd with -s and -o
"""

import base64
import sys
from math import cos, pi, sin, sqrt
from pathlib import Path
from struct import pack

from files import Gltf, folder, png, write
from shapes import Shape

out = Path(sys.argv[1]) if len(sys.argv) > 1 else folder("tests/references")
out.mkdir(parents=True, exist_ok=True)


def picture(alpha=False):
    """Returns 8 × 8 pixels with different rows, columns and corners."""
    rows = [[(30 + 28 * x, 220 - 26 * y, 200 if (x + y) % 2 else 40) for x in range(8)] for y in range(8)]
    rows[0][0] = (255, 0, 0)
    if alpha:
        rows = [
            [(*p, 255 if (x - 3.5) ** 2 + (y - 3) ** 2 < 9 else 20) for x, p in enumerate(r)]
            for y, r in enumerate(rows)
        ]
    return png(rows)


def embedded(gltf, data):
    uri = "data:image/png;base64," + base64.b64encode(data).decode()
    return gltf.add("images", {"uri": uri, "mimeType": "image/png"})


def board(gltf, name, at, material, low=-0.6, high=1.9, sets=1):
    corners = [(-0.45, -0.45, 0), (0.45, -0.45, 0), (0.45, 0.45, 0), (-0.45, 0.45, 0)]
    uv = [(low, high), (high, high), (high, low), (low, low)]
    attributes = {"POSITION": gltf.floats(corners, bounds=True), "NORMAL": gltf.floats([(0, 0, 1)] * 4)}
    for k in range(sets):
        attributes[f"TEXCOORD_{k}"] = gltf.floats([(u * (1 - 0.5 * k), v * (1 - 0.25 * k)) for u, v in uv])
    primitive = {"attributes": attributes, "indices": gltf.indices([(0, 1, 2), (0, 2, 3)]), "material": material}
    gltf.node(name, translation=list(at), mesh=gltf.add("meshes", {"name": name, "primitives": [primitive]}))


def wrap():
    """Returns a sampler; NEAREST where wrap modes differ by axis, since Blender's importer does not filter across seams then."""
    gltf = Gltf()
    gltf.json["extensionsUsed"] = ["KHR_texture_transform"]
    image, cut = embedded(gltf, picture()), embedded(gltf, picture(alpha=True))
    repeat, clamp, mirror = 10497, 33071, 33648
    turn = {"offset": [0.2, 0.35], "rotation": 0.5, "scale": [1.5, 0.7]}
    rows = [
        [(repeat, repeat, {}, {}), (clamp, clamp, {}, {}), (mirror, mirror, {}, {})],
        [(repeat, mirror, {}, {}), (mirror, clamp, {}, {}), (clamp, repeat, {}, {})],
        [
            (repeat, repeat, turn, {}),
            (mirror, mirror, {**turn, "texCoord": 1}, {}),
            (repeat, repeat, {}, {"alphaMode": "MASK", "alphaCutoff": 0.4}),
        ],
    ]
    for j, row in enumerate(rows):
        for i, (s, t, transform, alpha) in enumerate(row):
            size = 9729 if s == t else 9728
            sampler = gltf.add("samplers", {"magFilter": size, "minFilter": size, "wrapS": s, "wrapT": t})
            use = {"index": gltf.add("textures", {"source": cut if alpha else image, "sampler": sampler})}
            if transform:
                use["extensions"] = {"KHR_texture_transform": transform}
            name = f"Board {j} {i}"
            factor = [1, 0.8, 0.6, 1] if (i + j) % 2 else [1, 1, 1, 1]
            pbr = {"baseColorTexture": use, "baseColorFactor": factor, "metallicFactor": 0}
            material = gltf.add("materials", {"name": name, "pbrMetallicRoughness": pbr, **alpha})
            board(gltf, name, (i - 1, 1 - j, 0), material, sets=2 if "texCoord" in transform else 1)
    return gltf


def wedge(gltf, name, colour):
    """Returns a box without normals whose corners differ, so that no rotation or mirroring looks like another."""
    verts = [
        (-0.4, 0, -0.3),
        (0.4, 0, -0.3),
        (0.4, 0, 0.3),
        (-0.4, 0, 0.3),
        (-0.4, 0.7, -0.3),
        (0.1, 0.5, -0.3),
        (0.1, 0.35, 0.2),
        (-0.4, 0.6, 0.3),
    ]
    faces = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
    return gltf.mesh(name, Shape(verts, faces), gltf.material(name, colour))


def motion():
    gltf = Gltf()
    red, green, blue, gold = (
        wedge(gltf, *m)
        for m in (
            ("Red", (0.8, 0.1, 0.1)),
            ("Green", (0.1, 0.6, 0.2)),
            ("Blue", (0.1, 0.2, 0.8)),
            ("Gold", (0.9, 0.6, 0.1)),
        )
    )
    step = gltf.node("Step", mesh=red, translation=[-1.5, 0, 0])
    linear = gltf.node("Linear", mesh=green, translation=[0, 0, 0])
    spline = gltf.node("Spline", mesh=blue, translation=[1.5, 0, 0])
    child = gltf.node("Child", spline, mesh=gold, translation=[0.2, 0.7, 0], scale=[0.6, -0.6, 0.6])
    a = pi / 5  # columns: a turn about y, stretched along x, mirrored along z
    matrix = [1.3 * cos(a), 0, -1.3 * sin(a), 0, 0, 0.8, 0, 0, -sin(a), 0, -cos(a), 0, -0.6, -1.1, 0.2, 1]
    gltf.node("Matrix", mesh=gold, matrix=matrix)
    # A rotation below a non-uniform scale: the world matrix has shear.
    uneven = gltf.node("Uneven", translation=[1.0, -1.1, 0], scale=[1.5, 0.7, 1])
    gltf.node("Twisted", uneven, mesh=green, rotation=[0, 0, sin(0.35), cos(0.35)])

    def times(values):
        return gltf.add(
            "accessors",
            {
                "bufferView": gltf.view(pack(f"<{len(values)}f", *values)),
                "componentType": 5126,
                "count": len(values),
                "type": "SCALAR",
                "min": [values[0]],
                "max": [values[-1]],
            },
        )

    def y(angle):
        return (0, sin(angle / 2), 0, cos(angle / 2))

    half = sqrt(0.5)
    channels = [
        (step, "translation", "STEP", [0, 0.5, 1], [(-1.5, 0, 0), (-1.5, 0.4, 0.3), (-1.2, 0.9, 0)]),
        (step, "rotation", "STEP", [0, 0.5, 1], [y(0), y(0.8), y(2)]),
        (linear, "translation", "LINEAR", [0.25, 1], [(0, 0, 0), (0.3, 0.9, -0.6)]),
        (linear, "scale", "LINEAR", [0, 1], [(1, 1, 1), (0.5, 1.8, -1)]),
        (linear, "rotation", "LINEAR", [0, 0.625, 1.25], [y(0), (half, 0, 0, half), y(1)]),
        (
            spline,
            "translation",
            "CUBICSPLINE",
            [0, 0.625, 1.25],
            [(0, 0, 0), (1.5, 0, 0), (1, 2, 0)]
            + [(0, 1, 0), (1.4, 0.5, 0.3), (3, 0, 0)]
            + [(0, 0, 0), (1.5, 0, 0), (0, 0, 0)],
        ),
        (
            child,
            "rotation",
            "CUBICSPLINE",
            [0, 0.625],
            [(0, 0, 0, 0), y(0), (0, 1, 0, 0)] + [(0, 1, 0, 0), y(1.1), (0, 0, 0, 0)],
        ),
    ]
    animation = {"name": "Motion", "channels": [], "samplers": []}
    for node, path, interpolation, keys, values in channels:
        sampler = {"input": times(keys), "output": gltf.floats(values), "interpolation": interpolation}
        animation["channels"].append({"sampler": len(animation["samplers"]), "target": {"node": node, "path": path}})
        animation["samplers"].append(sampler)
    gltf.add("animations", animation)
    for accessor in gltf.json["accessors"]:  # views of keys are not for the GPU
        if not any(
            accessor is gltf.json["accessors"][i]
            for m in gltf.json["meshes"]
            for p in m["primitives"]
            for i in (*p["attributes"].values(), p["indices"])
        ):
            gltf.json["bufferViews"][accessor["bufferView"]].pop("target", None)
    return gltf


def groups():
    lines = ["# n-gons, smoothing groups and materials", "mtllib groups.mtl"]

    def vertices(points):
        lines.extend("v " + " ".join(f"{c:.6g}" for c in p) for p in points)

    # A concave star and a C, standing, flat; the star is one line broken by a backslash.
    star = [
        (-1.3 + (0.6 if k % 2 else 0.25) * sin(k * pi / 5), 0.7 + (0.6 if k % 2 else 0.25) * cos(k * pi / 5), 0)
        for k in range(10)
    ]
    lines += ["o Star", "s off", "usemtl Plain"]
    vertices(star)
    lines += ["f -10 -9 -8 -7 -6 \\", "  -5 -4 -3 -2 -1"]
    letter = [(0, 0), (0.9, 0), (0.9, 0.25), (0.3, 0.25), (0.3, 0.95), (0.9, 0.95), (0.9, 1.2), (0, 1.2)]
    lines += ["o Letter", "usemtl Painted"]
    vertices([(x - 0.4, y + 0.1, -0.2 * x) for x, y in letter])
    lines.extend(f"vt {x:.6g} {y:.6g}" for x, y in letter)
    lines.append("f " + " ".join(f"{k - 8}/{k - 8}" for k in range(8)))
    # Two tubes of eight sides: a smooth one (group 3) with flat octagonal caps, and a flat one.
    for name, at, group, material in (("Smooth", 1.3, "3", "Plain"), ("Flat", 2.4, "0", "Other")):
        ring = [(at + 0.4 * cos(k * pi / 4), 0.4 * sin(k * pi / 4)) for k in range(8)]
        lines += [f"o {name} tube", f"usemtl {material}", f"s {group}"]
        vertices([(x, 0.1, z) for x, z in ring] + [(x, 1.2, z) for x, z in ring])
        lines.extend(f"f {k - 16} {k - 8} {(k + 1) % 8 - 8} {(k + 1) % 8 - 16}" for k in range(8))
        lines += ["s off"]
        vertices([(x, 1.2, z) for x, z in ring])
        lines.append("f " + " ".join(str(-1 - k) for k in range(8)))
    # A floor of one painted square, moved and repeated by the map's own options.
    lines += ["o Floor", "usemtl Tiled"]
    vertices([(-2, 0, -1), (3, 0, -1), (3, 0, 1.5), (-2, 0, 1.5)])
    lines += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1", "f -4/-4 -1/-1 -2/-2 -3/-3"]
    mtl = """newmtl Plain
Kd 0.7 0.5 0.2

newmtl Other
Kd .1 .5 .6

newmtl Painted
Kd 1 1 1
map_Kd groups.png

newmtl Tiled
Kd 1 1 1
map_Kd -s 3 2 1 -o 0.25 0.1 0 groups.png
"""
    return "\n".join(lines) + "\n", mtl


wrap().write_embedded(out / "wrap.gltf")
motion().write_embedded(out / "motion.gltf")
obj, mtl = groups()
write(out / "groups.obj", obj)
write(out / "groups.mtl", mtl)
write(out / "groups.png", picture())
