"""Writes the uncompressed twins and the fixtures that need no encoder: variants, animation pointers, manual quantization."""

import json
from math import cos, pi, sin

from glb import F32, I8, I16, OUT, U8, U16, U32, Gltf, png
from shapes import box, flat, patch, strip, torus

KIND = {"POSITION": "VEC3", "NORMAL": "VEC3", "TANGENT": "VEC4", "TEXCOORD_0": "VEC2", "TEXCOORD_1": "VEC2"}


def attributes(gltf, shape):
    return {k: gltf.attribute(KIND[k], rows, bounds=k == "POSITION") for k, rows in shape.items() if k in KIND}


def primitive(gltf, shape, triangles, material=None, component=U16):
    item = {"attributes": attributes(gltf, shape), "indices": gltf.indices(flat(triangles), component)}
    if material is not None:
        item["material"] = material
    return item


def about(axis, angle):
    s = sin(angle / 2)
    return [axis[0] * s, axis[1] * s, axis[2] * s, cos(angle / 2)]


def channel(gltf, animation, node, path, times, kind, values, interpolation="LINEAR"):
    sampler = {
        "input": gltf.accessor("SCALAR", times, bounds=True),
        "output": gltf.accessor(kind, values),
        "interpolation": interpolation,
    }
    animation["samplers"].append(sampler)
    target = {"path": path} if node is None else {"node": node, "path": path}
    animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": target})
    return animation["channels"][-1]


def image():
    """16 × 16: a diagonal gradient with a marked corner, for the animated texture offset."""
    return png(
        [[(255, 32, 32) if x < 4 and y < 4 else (16 * x, 16 * y, 128) for x in range(16)] for y in range(16)]
    )


def textured(gltf, name, rgba, second=False):
    """A material with a base colour texture (and occlusion by the second UV set), so that gltfpack writes
    KHR_texture_transform for its quantised UVs."""
    source = gltf.add("images", {"name": "gradient", "mimeType": "image/png", "bufferView": gltf.view(image())})
    texture = gltf.add("textures", {"source": source})
    m = gltf.material(name, rgba)
    gltf.json["materials"][m]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": texture}
    if second:
        gltf.json["materials"][m]["occlusionTexture"] = {"index": texture, "texCoord": 1, "strength": 0.5}
    return m


def full():
    """torus: every attribute, a skin of three joints and an animation of them."""
    g = Gltf()
    shape, triangles = torus()
    p = primitive(g, shape, triangles, textured(g, "Painted", (0.9, 0.9, 0.9, 1), second=True))
    p["attributes"]["COLOR_0"] = g.attribute("VEC4", shape["COLOR_0"], U8, normalized=True)
    joints, weights = [], []
    for t in shape["t"]:
        k = min(int(t * 2), 1)
        f = t * 2 - k
        joints.append((k if f < 1 else 0, k + 1 if f > 0 else 0, 0, 0))
        weights.append((1 - f, f, 0.0, 0.0))
    p["attributes"]["JOINTS_0"] = g.attribute("VEC4", joints, U8)
    p["attributes"]["WEIGHTS_0"] = g.attribute("VEC4", weights)
    mesh = g.add("meshes", {"name": "Torus", "primitives": [p]})
    g.node("Torus", mesh=mesh, skin=0)
    bones = [g.node("Bone 0", translation=[-1, 0, 0])]
    bones += [g.node("Bone 1", bones[0], translation=[1, 0, 0])]
    bones += [g.node("Bone 2", bones[1], translation=[1, 0, 0])]
    inverse = [[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1 - i, 0, 0, 1] for i in range(3)]
    g.add("skins", {"joints": bones, "inverseBindMatrices": g.accessor("MAT4", inverse), "skeleton": bones[0]})
    bend = {"name": "Bend", "channels": [], "samplers": []}
    times = [i / 8 for i in range(9)]
    channel(g, bend, bones[1], "rotation", times, "VEC4", [about((0, 0, 1), 0.6 * sin(2 * pi * t)) for t in times])
    channel(g, bend, bones[2], "rotation", times, "VEC4", [about((0.6, 0.8, 0), 0.9 * sin(2 * pi * t)) for t in times])
    channel(g, bend, bones[0], "translation", times, "VEC3", [(-1, 0.25 * sin(2 * pi * t), 0) for t in times])
    g.add("animations", bend)
    g.write("torus.glb")


def ring():
    """ring: over 1,000 triangles (so that Draco takes its valence edgebreaker and meshoptimizer several blocks of
    vertices), two parts: a torus with UV seams and an open patch with a hole."""
    g = Gltf()
    shape, triangles = torus(30, 16)
    part, more = patch(9, 9)
    first = len(shape["POSITION"])
    whole = {k: shape[k] + part[k] for k in ("POSITION", "NORMAL", "TEXCOORD_0")}
    more = [t for i, t in enumerate(more) if i // 2 not in (27, 28, 35, 36)]
    triangles = triangles + [tuple(c + first for c in t) for t in more]
    p = primitive(g, whole, triangles, g.material("Ring", (0.8, 0.6, 0.2, 1)))
    g.node("Ring", mesh=g.add("meshes", {"name": "Ring", "primitives": [p]}))
    g.write("ring.glb")


def morph():
    """patch: two morph targets (positions and normals) and an animation of their weights."""
    g = Gltf()
    base, triangles = patch()
    bump, _ = patch(height=lambda u, v: 0.2 * sin(5 * u) * cos(4 * v) + 0.5 * sin(pi * u) * sin(pi * v))
    tilt, _ = patch(height=lambda u, v: 0.2 * sin(5 * u) * cos(4 * v) - 0.8 * u)
    p = primitive(g, base, triangles, textured(g, "Cloth", (0.2, 0.5, 0.8, 1)))

    def deltas(shape, key):
        return [tuple(a - b for a, b in zip(x, y)) for x, y in zip(shape[key], base[key])]

    p["targets"] = [
        {
            "POSITION": g.attribute("VEC3", deltas(s, "POSITION"), bounds=True),
            "NORMAL": g.attribute("VEC3", deltas(s, "NORMAL")),
        }
        for s in (bump, tilt)
    ]
    mesh = {"name": "Cloth", "primitives": [p], "weights": [0.25, 0], "extras": {"targetNames": ["Bump", "Tilt"]}}
    node = g.node("Cloth", mesh=g.add("meshes", mesh))
    wave = {"name": "Wave", "channels": [], "samplers": []}
    times = [i / 4 for i in range(5)]
    channel(g, wave, node, "weights", times, "SCALAR", [w for t in times for w in (sin(pi * t), t * t)])
    g.add("animations", wave)
    g.write("patch.glb")


def mixed():
    """mixed: a mesh of four primitives: two of triangles, lines, points; vertex colours of three kinds."""
    g = Gltf()
    red, blue = g.material("Red", (0.8, 0.1, 0.1, 1)), g.material("Blue", (0.1, 0.2, 0.8, 1))
    a, ta = box(1, 1, 1)
    b, tb = torus(8, 6, 0.8, 0.2)
    first = primitive(g, {k: a[k] for k in a}, ta, red)
    first["attributes"]["COLOR_0"] = g.attribute(
        "VEC3", [(65535 * (i % 4) // 3, 65535 * (i // 4) // 5, 32768) for i in range(24)], U16, normalized=True
    )
    second = primitive(g, {k: b[k] for k in ("POSITION", "NORMAL", "TEXCOORD_0")}, tb, blue, U32)
    second["attributes"]["COLOR_0"] = g.attribute("VEC4", [tuple(c / 255 for c in r) for r in b["COLOR_0"]])
    ring = [(1.2 * cos(2 * pi * i / 16), 0.0, 1.2 * sin(2 * pi * i / 16)) for i in range(16)]
    line = {
        "attributes": {
            "POSITION": g.attribute("VEC3", ring, bounds=True),
            "COLOR_0": g.attribute("VEC3", [(i / 15, 0.5, 1 - i / 15) for i in range(16)]),
        },
        "indices": g.indices([i for k in range(16) for i in (k, (k + 1) % 16)]),
        "mode": 1,
        "material": red,
    }
    points = {"attributes": {"POSITION": line["attributes"]["POSITION"]}, "mode": 0, "material": blue}
    mesh = g.add("meshes", {"name": "Mixed", "primitives": [first, second, line, points]})
    g.node("Mixed", mesh=mesh)
    g.write("mixed.glb")


def strips():
    """strip: one primitive of mode TRIANGLE_STRIP with indices; strip_list: its triangles as a list."""
    for name, listed in (("strip.glb", False), ("strip_list.glb", True)):
        g = Gltf()
        shape, indices, triangles = strip()
        p = primitive(g, shape, triangles if listed else [], g.material("Band", (0.3, 0.7, 0.3, 1))) if listed else {
            "attributes": attributes(g, shape),
            "indices": g.indices(indices),
            "mode": 5,
            "material": g.material("Band", (0.3, 0.7, 0.3, 1)),
        }
        g.node("Band", mesh=g.add("meshes", {"name": "Band", "primitives": [p]}))
        g.write(name)


def instances():
    """instances: 24 nodes of one box and 6 of one torus, turned and scaled, one of each mirrored; and the same with
    EXT_mesh_gpu_instancing written by hand (float TRS, and normalised-short rotations)."""
    boxes = [
        (
            (1.5 * (i % 6) - 3.75, 0.4 * (i // 6), 1.5 * (i // 6) - 2.25),
            about((0, 1, 0), 0.35 * i),
            (0.4 + 0.02 * i, 0.5, 0.6),
        )
        for i in range(24)
    ]
    rings = [((i - 2.5, 2.5, 0.0), about((1, 0, 0), 0.4 * i), (0.4, 0.4, 0.4)) for i in range(6)]
    boxes[5] = (boxes[5][0], boxes[5][1], (-0.5, 0.5, 0.5))
    rings[4] = (rings[4][0], rings[4][1], (0.4, -0.4, 0.4))
    for name in ("instances.glb", "instances_gpu.glb"):
        g = Gltf()
        a, ta = box()
        b, tb = torus(10, 6)
        pa = primitive(g, a, ta, g.material("Brick", (0.7, 0.3, 0.2, 1)))
        pb = primitive(g, {k: b[k] for k in ("POSITION", "NORMAL")}, tb, g.material("Steel", (0.6, 0.6, 0.65, 1), 1, 0.3))
        meshes = [g.add("meshes", {"name": n, "primitives": [p]}) for n, p in (("Box", pa), ("Ring", pb))]
        parent = g.node("Group", translation=[0, 0.5, 0], rotation=about((0, 1, 0), 0.3))
        for mesh, label, list_ in ((meshes[0], "Box", boxes), (meshes[1], "Ring", rings)):
            if name == "instances.glb":
                for i, (t, r, s) in enumerate(list_):
                    g.node(f"{label} {i}", parent, mesh=mesh, translation=list(t), rotation=r, scale=list(s))
                continue
            g.uses("EXT_mesh_gpu_instancing", required=True)
            turned = (
                g.accessor("VEC4", [r for _, r, _ in list_])
                if label == "Box"
                else g.accessor("VEC4", [[round(c * 32767) for c in r] for _, r, _ in list_], I16, normalized=True)
            )
            extension = {
                "attributes": {
                    "TRANSLATION": g.accessor("VEC3", [t for t, _, _ in list_]),
                    "ROTATION": turned,
                    "SCALE": g.accessor("VEC3", [s for _, _, s in list_]),
                }
            }
            g.node(f"{label}es" if label == "Box" else "Rings", parent, mesh=mesh, extensions={"EXT_mesh_gpu_instancing": extension})
        g.write(name)


def quantised():
    """quantised: KHR_mesh_quantization by hand: i16 (not normalised) positions under a node that scales, i8 normals
    with stride 4, u16 normalised UVs; a second mesh with i8 normalised positions, unsigned-byte UVs that are not
    normalised, i16 morph deltas. quantised_twin: the same in floats."""
    base, triangles = patch(6, 5)
    bump, _ = patch(6, 5, height=lambda u, v: 0.2 * sin(5 * u) * cos(4 * v) + 0.5 * sin(pi * u) * sin(pi * v))
    deltas = [tuple(a - b for a, b in zip(x, y)) for x, y in zip(bump["POSITION"], base["POSITION"])]
    scale = 1 / 4096
    q = [tuple(round(c / scale) for c in p) for p in base["POSITION"]]
    qd = [tuple(round(c / scale) for c in p) for p in deltas]
    qn = [tuple(round(c * 127) for c in p) for p in base["NORMAL"]]
    qt = [tuple(round(c * 65535) for c in p) for p in base["TEXCOORD_0"]]
    cube, cube_triangles = box(2, 2, 2)
    c8 = [tuple(round(127 * c) for c in p) for p in cube["POSITION"]]
    for name, twin in (("quantised.glb", False), ("quantised_twin.glb", True)):
        g = Gltf()
        if not twin:
            g.uses("KHR_mesh_quantization", required=True)
        grey = g.material("Grey", (0.6, 0.6, 0.6, 1))
        if twin:
            def real(rows, factor):
                return [tuple(c * factor for c in r) for r in rows]

            first = {
                "POSITION": g.attribute("VEC3", q, bounds=True),
                "NORMAL": g.attribute("VEC3", real(qn, 1 / 127)),
                "TEXCOORD_0": g.attribute("VEC2", real(qt, 1 / 65535)),
            }
            target = {"POSITION": g.attribute("VEC3", qd, bounds=True)}
            second = {
                "POSITION": g.attribute("VEC3", real(c8, 1 / 127), bounds=True),
                "NORMAL": g.attribute("VEC3", cube["NORMAL"]),
                "TEXCOORD_0": g.attribute("VEC2", [(3 * u, 2 * v) for u, v in cube["TEXCOORD_0"]]),
            }
        else:
            first = {
                "POSITION": g.attribute("VEC3", q, I16, bounds=True),
                "NORMAL": g.attribute("VEC3", qn, I8, normalized=True),
                "TEXCOORD_0": g.attribute("VEC2", qt, U16, normalized=True),
            }
            target = {"POSITION": g.attribute("VEC3", qd, I16, bounds=True)}
            second = {
                "POSITION": g.attribute("VEC3", c8, I8, normalized=True, bounds=True),
                "NORMAL": g.attribute("VEC3", [tuple(int(127 * c) for c in n) for n in cube["NORMAL"]], I8, normalized=True),
                "TEXCOORD_0": g.attribute("VEC2", [(round(3 * u), round(2 * v)) for u, v in cube["TEXCOORD_0"]], U8),
            }
        cloth = {"attributes": first, "indices": g.indices(flat(triangles)), "material": grey, "targets": [target]}
        cubes = {"attributes": second, "indices": g.indices(flat(cube_triangles)), "material": grey}
        g.node("Cloth", mesh=g.add("meshes", {"name": "Cloth", "primitives": [cloth], "weights": [0.5]}), scale=[scale] * 3)
        g.node("Cube", mesh=g.add("meshes", {"name": "Cube", "primitives": [cubes]}), translation=[3, 0, 0])
        g.write(name)


def variants():
    """variants: three variants over three primitives: one maps all three, one maps two of them (the third keeps its
    own material), one has no mapping and one mapping serves two variants."""
    g = Gltf()
    g.uses("KHR_materials_variants")
    names = ["Day", "Dusk", "Night"]
    g.json["extensions"] = {"KHR_materials_variants": {"variants": [{"name": n} for n in names]}}
    colours = {
        "Plain": (0.7, 0.7, 0.7, 1),
        "Sand": (0.9, 0.8, 0.5, 1),
        "Rust": (0.7, 0.3, 0.1, 1),
        "Ink": (0.05, 0.05, 0.2, 1),
        "Moss": (0.2, 0.5, 0.2, 1),
    }
    m = {n: g.material(n, c) for n, c in colours.items()}
    a, ta = box()

    def map_(*items):
        mappings = [{"material": m[name], "variants": list(which)} for name, which in items]
        return {"KHR_materials_variants": {"mappings": mappings}}

    first = {**primitive(g, a, ta, m["Plain"]), "extensions": map_(("Sand", [0]), ("Rust", [1]), ("Ink", [2]))}
    second = {**first, "material": m["Moss"], "extensions": map_(("Ink", [1, 2]))}
    third = {**first, "material": m["Rust"]}
    del third["extensions"]
    for i, (name, p) in enumerate((("All mapped", first), ("Day not mapped", second), ("Not mapped", third))):
        g.node(name, mesh=g.add("meshes", {"name": name, "primitives": [p]}), translation=[1.5 * i - 1.5, 0, 0])
    g.write("variants.glb")


def pointers():
    """pointers: KHR_animation_pointer on materials, lights, a camera, node visibility and TRS, texture transform and
    morph weights, with LINEAR, STEP and CUBICSPLINE. pointers.json holds the expected values at given times."""
    g = Gltf()
    for name in (
        "KHR_animation_pointer",
        "KHR_lights_punctual",
        "KHR_materials_emissive_strength",
        "KHR_texture_transform",
        "KHR_node_visibility",
    ):
        g.uses(name)
    source = g.add("images", {"name": "gradient", "mimeType": "image/png", "bufferView": g.view(image())})
    g.add("samplers", {"wrapS": 10497, "wrapT": 10497})
    texture = g.add("textures", {"source": source, "sampler": 0})
    glowing = g.material(
        "Glowing",
        (1, 1, 1, 1),
        emissiveFactor=[1, 0.5, 0.25],
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 1.0}},
    )
    moved = g.material("Moved", (1, 1, 1, 1))
    g.json["materials"][moved]["pbrMetallicRoughness"]["baseColorTexture"] = {
        "index": texture,
        "extensions": {"KHR_texture_transform": {"offset": [0, 0], "scale": [2, 2], "rotation": 0}},
    }
    g.json["materials"][moved]["alphaMode"] = "MASK"
    g.json["materials"][moved]["alphaCutoff"] = 0.5
    a, ta = box()
    base, tp = patch(5, 4)
    lifted = [(0, 0.5 * v[0] ** 2, 0) for v in base["POSITION"]]
    cloth = primitive(g, base, tp, moved)
    cloth["targets"] = [{"POSITION": g.attribute("VEC3", lifted, bounds=True)}]
    meshes = [
        g.add("meshes", {"name": "Glowing box", "primitives": [primitive(g, a, ta, glowing)]}),
        g.add("meshes", {"name": "Cloth", "primitives": [cloth], "weights": [0]}),
    ]
    g.json["extensions"] = {
        "KHR_lights_punctual": {
            "lights": [
                {"type": "point", "name": "Lamp", "color": [1, 1, 1], "intensity": 10, "range": 8},
                {
                    "type": "spot",
                    "name": "Spot",
                    "intensity": 40,
                    "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5},
                },
            ]
        }
    }
    g.add(
        "cameras",
        {"type": "perspective", "name": "Lens", "perspective": {"yfov": 0.8, "znear": 0.1, "zfar": 50}},
    )
    g.add(
        "cameras",
        {"type": "orthographic", "name": "Plan", "orthographic": {"xmag": 2, "ymag": 2, "znear": 0.1, "zfar": 50}},
    )
    g.node("Box", mesh=meshes[0], extensions={"KHR_node_visibility": {"visible": True}})
    g.node("Child of box", 0, mesh=meshes[0], translation=[0, 1, 0], scale=[0.3, 0.3, 0.3])
    g.node("Cloth", mesh=meshes[1], translation=[2, 0, 0])
    g.node("Lamp", translation=[0, 3, 0], extensions={"KHR_lights_punctual": {"light": 0}})
    g.node("Spot", translation=[2, 3, 0], rotation=about((1, 0, 0), -pi / 2), extensions={"KHR_lights_punctual": {"light": 1}})
    g.node("Camera", camera=0, translation=[0, 1, 6])
    g.node("Plan", camera=1, translation=[0, 6, 0], rotation=about((1, 0, 0), -pi / 2))

    show = {"name": "Show", "channels": [], "samplers": []}
    checks = []

    def spline(times, values, tangents):
        rows = []
        for v, (i, o) in zip(values, tangents):
            rows += [i, v, o]
        return rows

    def at(t, times, values, interpolation, tangents):
        """The value at t, by appendix C of the glTF specification (no pointer here is a quaternion)."""
        if t <= times[0]:
            return list(values[0])
        if t >= times[-1]:
            return list(values[-1])
        k = max(i for i, x in enumerate(times) if x <= t)
        d = times[k + 1] - times[k]
        s = (t - times[k]) / d
        if interpolation == "STEP":
            return list(values[k])
        if interpolation == "LINEAR":
            return [a + (b - a) * s for a, b in zip(values[k], values[k + 1])]
        s2, s3 = s * s, s * s * s
        return [
            (2 * s3 - 3 * s2 + 1) * a + d * (s3 - 2 * s2 + s) * o + (3 * s2 - 2 * s3) * b + d * (s3 - s2) * i
            for a, o, b, i in zip(values[k], tangents[k][1], values[k + 1], tangents[k + 1][0])
        ]

    def pointer(path, kind, times, values, interpolation="LINEAR", tangents=None, component=F32, normalized=False):
        values = [v if isinstance(v, tuple) else (v,) for v in values]
        rows = spline(times, values, tangents) if interpolation == "CUBICSPLINE" else values
        meant = [tuple(c / 255 for c in v) for v in values] if normalized else values
        sampler = {
            "input": g.accessor("SCALAR", times, bounds=True),
            "output": g.accessor(kind, rows, component, normalized),
            "interpolation": interpolation,
        }
        show["samplers"].append(sampler)
        show["channels"].append(
            {
                "sampler": len(show["samplers"]) - 1,
                "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": path}}},
            }
        )
        samples = {f"{t:g}": at(t, times, meant, interpolation, tangents) for t in (0, 0.25, 0.5, 0.8, 1, 1.5, 2, 3)}
        checks.append({"pointer": path, "interpolation": interpolation, "values": samples})

    zero4 = ((0, 0, 0, 0), (0, 0, 0, 0))
    pointer("/materials/0/pbrMetallicRoughness/baseColorFactor", "VEC4", [0, 1, 2], [(1, 1, 1, 1), (1, 0, 0, 1), (0, 0, 1, 1)])
    pointer(
        "/materials/0/pbrMetallicRoughness/roughnessFactor", "SCALAR", [0, 2], [0.0, 1.0], "CUBICSPLINE",
        [((0,), (1.5,)), ((0,), (0,))],
    )
    pointer("/materials/0/pbrMetallicRoughness/metallicFactor", "SCALAR", [0, 1], [0.0, 1.0], "STEP")
    pointer("/materials/0/emissiveFactor", "VEC3", [0, 2], [(1, 0.5, 0.25), (0, 1, 0)])
    pointer(
        "/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength", "SCALAR", [0, 1, 2], [1.0, 5.0, 2.0]
    )
    pointer(
        "/materials/1/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/offset",
        "VEC2", [0, 2], [(0, 0), (1, 0.5)],
    )
    pointer(
        "/materials/1/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/rotation",
        "SCALAR", [0, 2], [0.0, 1.0],
    )
    pointer(
        "/materials/1/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/scale",
        "VEC2", [0, 2], [(2, 2), (1, 4)],
    )
    pointer("/materials/1/alphaCutoff", "SCALAR", [0, 2], [0, 255], component=U8, normalized=True)
    pointer("/extensions/KHR_lights_punctual/lights/0/intensity", "SCALAR", [0, 1, 2], [10.0, 100.0, 10.0])
    pointer("/extensions/KHR_lights_punctual/lights/0/color", "VEC3", [0, 2], [(1, 1, 1), (1, 0.2, 0)])
    pointer("/extensions/KHR_lights_punctual/lights/0/range", "SCALAR", [0, 2], [8.0, 20.0])
    pointer("/extensions/KHR_lights_punctual/lights/1/spot/outerConeAngle", "SCALAR", [0, 2], [0.5, 1.0])
    pointer("/extensions/KHR_lights_punctual/lights/1/spot/innerConeAngle", "SCALAR", [0, 2], [0.2, 0.4])
    pointer("/cameras/0/perspective/yfov", "SCALAR", [0.5, 1.5], [0.8, 0.4])
    pointer("/cameras/1/orthographic/xmag", "SCALAR", [0, 2], [2.0, 4.0])
    pointer("/nodes/0/extensions/KHR_node_visibility/visible", "SCALAR", [0, 0.75, 1.5], [1, 0, 1], "STEP", component=U8)
    pointer("/nodes/2/translation", "VEC3", [0, 2], [(2, 0, 0), (2, 2, 0)])
    pointer("/nodes/2/weights/0", "SCALAR", [0, 2], [0.0, 1.0])
    # One ordinary channel in the same animation.
    channel(g, show, 1, "rotation", [0, 2], "VEC4", [about((0, 1, 0), 0), about((0, 1, 0), 1)])
    g.add("animations", show)
    # A second animation whose pointers must be ignored: an unknown extension, an index out of range.
    odd = {"name": "Odd", "channels": [], "samplers": []}
    for path in ("/materials/0/extensions/ACME_shimmer/amount", "/materials/99/alphaCutoff", "/nodes/0/name"):
        odd["samplers"].append({"input": show["samplers"][3]["input"], "output": show["samplers"][6]["output"]})
        odd["channels"].append(
            {
                "sampler": len(odd["samplers"]) - 1,
                "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": path}}},
            }
        )
    g.add("animations", odd)
    g.write("pointers.glb")
    text = "[\n" + ",\n".join("  " + json.dumps(c) for c in checks) + "\n]\n"
    (OUT / "pointers.json").write_text(text)


for make in (full, ring, morph, mixed, strips, instances, quantised, variants, pointers):
    make()
