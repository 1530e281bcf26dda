"""A reconstruction from three photographs, as programs for structure from motion export them: reconstruction.glb.

A coloured cloud of points, the frustum of each camera and the axes of the world as lines, the cameras
themselves, and an overview. Plain Python, no Blender. Each point is a pixel of one of the photographs, so
the cloud is dense near the cameras, sparse far away and empty where no camera looks.
"""

import struct
from math import atan2, exp, floor, hypot, pi, sin, tan
from random import Random

from files import Gltf, folder, look_at

WIDTH, HEIGHT, YFOV = 96, 72, 0.72
TARGET = (0, 0.32, 0)
# Name, eye, colour of its frustum in linear light.
CAMERAS = [
    ("Left", (-1.3, 0.95, 1.3), (0.8, 0.1, 0.03)),
    ("Middle", (0.15, 1.4, 1.65), (0.05, 0.42, 0.08)),
    ("Right", (1.5, 0.75, 0.8), (0.06, 0.16, 0.75)),
]
LIGHT = (0.45, 0.8, 0.4)


def add(a, b, t=1.0):
    return tuple(p + t * q for p, q in zip(a, b))


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def unit(a):
    return add((0, 0, 0), a, dot(a, a) ** -0.5)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def jug(x, y, z):
    """The distance to a jug: a curved body with an open top, and a handle."""
    radius = 0.2 + 0.09 * sin(5.2 * y + 0.6) - 0.05 * y
    body = max(abs(hypot(x, z) - radius) - 0.018, -y, y - 0.78) * 0.8
    handle = hypot(hypot(x + 0.2, (y - 0.45) * 0.8) - 0.2, z) - 0.028
    return min(body, max(handle, x + 0.17))


def ball(x, y, z):
    return hypot(x - 0.52, y - 0.15, z - 0.3) - 0.15


def crate(x, y, z):
    c, s = 0.84, 0.54
    a, b, d = abs(c * (x - 0.4) - s * (z + 0.45)) - 0.2, abs(y - 0.16) - 0.16, abs(s * (x - 0.4) + c * (z + 0.45)) - 0.2
    return hypot(max(a, 0), max(b, 0), max(d, 0)) + min(max(a, b, d), 0)


def table(x, y, z):
    return max(abs(y + 0.02) - 0.02, hypot(x, z) - 1.05)


def distance(p):
    return min(jug(*p), ball(*p), crate(*p), table(*p))


def paint(p):
    """The colour of the surface at a point, in linear light."""
    x, y, z = p
    part = min((jug, ball, crate, table), key=lambda part: part(*p))
    if part is jug:
        band = 0.3 < y < 0.52 and hypot(x, z) < 0.32
        wave = abs(y - 0.41 - 0.05 * sin(8 * atan2(z, x))) < 0.025
        return (0.75, 0.62, 0.42) if band and wave else (0.06, 0.16, 0.3) if band else (0.6, 0.3, 0.14)
    if part is ball:
        return (0.75, 0.05, 0.05) if floor(4 * (atan2(z - 0.3, x - 0.52) / pi + 1)) % 2 else (0.8, 0.75, 0.65)
    if part is crate:
        return (0.32, 0.17, 0.07) if floor(y / 0.08) % 2 else (0.45, 0.26, 0.11)
    ring = floor(hypot(x, z) / 0.15) % 2
    return (0.2, 0.3, 0.2) if ring else (0.42, 0.46, 0.36)


def march(eye, direction, limit):
    """The distance along a ray to the surface, or None."""
    t = 0.02
    for _ in range(200):
        step = distance(add(eye, direction, t))
        if step < 4e-4:
            return t
        t += step
        if t > limit:
            return None
    return None


def photographed(p):
    """The colour with light and shadow: no renderer lights points without normals."""
    e = 1e-3
    normal = unit(
        tuple(
            distance(add(p, axis, e)) - distance(add(p, axis, -e)) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))
        )
    )
    light = unit(LIGHT)
    lit = max(dot(normal, light), 0)
    if lit and march(add(p, normal, 5e-3), light, 3) is not None:
        lit = 0
    occlusion = 1 - exp(-6 * max(distance(add(p, normal, 0.15)), 0))
    return tuple(c * (0.35 * (0.4 + 0.6 * occlusion) + 0.9 * lit) for c in paint(p))


def photograph(eye, random):
    """Points and colours that a camera sees; depths have errors that grow with the distance, as matching has."""
    w = unit(add(eye, TARGET, -1))
    u = unit(cross((0, 1, 0), w))
    v = cross(w, u)
    scale = 2 * tan(YFOV / 2) / HEIGHT
    for j in range(HEIGHT):
        for i in range(WIDTH):
            x, y = (i + 0.5 - WIDTH / 2) * scale, (HEIGHT / 2 - j - 0.5) * scale
            direction = unit(add(add(add((0, 0, 0), u, x), v, y), w, -1))
            t = march(eye, direction, 8)
            error = random.gauss(0, 8e-4)
            if t is not None:
                yield add(eye, direction, t + error * t * t), photographed(add(eye, direction, t))


def colors(gltf, rows):
    """A normalised u8 accessor of linear RGB colours with alpha 1."""
    data = bytes(c for row in rows for c in (*(min(round(255 * c), 255) for c in row), 255))
    view = gltf.view(data, 34962)
    return gltf.add(
        "accessors",
        {"bufferView": view, "componentType": 5121, "normalized": True, "count": len(rows), "type": "VEC4"},
    )


def u16(gltf, values):
    view = gltf.view(struct.pack(f"<{len(values)}H", *values), 34963)
    return gltf.add(
        "accessors", {"bufferView": view, "componentType": 5123, "count": len(values), "type": "SCALAR"}
    )


def camera(gltf, name, yfov=YFOV):
    perspective = {"aspectRatio": WIDTH / HEIGHT, "yfov": yfov, "znear": 0.01}
    return gltf.add("cameras", {"type": "perspective", "name": name, "perspective": perspective})


POINTS, LINES, LINE_LOOP, LINE_STRIP = 0, 1, 2, 3

out = folder("reconstruction")
gltf = Gltf()
eye = (0.6, 2.0, 4.3)
gltf.node("Overview", camera=camera(gltf, "Overview", 0.62), **look_at(eye, add((-0.05, 0.5, 0.2), eye, -1)))

random = Random(71)
cloud = [point for _, eye, _ in CAMERAS for point in photograph(eye, random)]
positions, rgb = zip(*cloud)
attributes = {"POSITION": gltf.floats(positions, bounds=True), "COLOR_0": colors(gltf, rgb)}
primitives = [{"mode": POINTS, "attributes": attributes}]
gltf.node("Cloud", mesh=gltf.add("meshes", {"name": "Cloud", "primitives": primitives}))

# The frustum at depth 0.3: its apex, then the corners of the picture.
h = 0.3 * tan(YFOV / 2)
w = h * WIDTH / HEIGHT
apex = gltf.floats([(0, 0, 0), (-w, h, -0.3), (w, h, -0.3), (w, -h, -0.3), (-w, -h, -0.3)], bounds=True)
sides, picture = u16(gltf, [0, 1, 0, 2, 0, 3, 0, 4]), u16(gltf, [1, 2, 3, 4])
for name, eye, color in CAMERAS:
    material = gltf.material(name, color)
    primitives = [
        {"mode": mode, "attributes": {"POSITION": apex}, "indices": indices, "material": material}
        for mode, indices in ((LINES, sides), (LINE_LOOP, picture))
    ]
    mesh = gltf.add("meshes", {"name": f"{name} frustum", "primitives": primitives})
    gltf.node(f"{name} camera", mesh=mesh, camera=camera(gltf, name), **look_at(eye, add(TARGET, eye, -1)))

path = {"POSITION": gltf.floats([eye for _, eye, _ in CAMERAS], bounds=True)}
primitives = [{"mode": LINE_STRIP, "attributes": path, "material": gltf.material("Path", (0.15, 0.15, 0.15))}]
gltf.node("Path", mesh=gltf.add("meshes", {"name": "Path", "primitives": primitives}))

axes = [(0, 0, 0), (0.5, 0, 0), (0, 0, 0), (0, 0.5, 0), (0, 0, 0), (0, 0, 0.5)]
hues = [(1, 0.02, 0.02), (0.02, 0.6, 0.02), (0.05, 0.1, 1)]
attributes = {"POSITION": gltf.floats(axes, bounds=True), "COLOR_0": colors(gltf, [c for c in hues for _ in "ab"])}
primitives = [{"mode": LINES, "attributes": attributes}]
mesh = gltf.add("meshes", {"name": "Axes", "primitives": primitives})
gltf.node("Axes", mesh=mesh, translation=[-0.95, 0.01, 0.95])
gltf.write_glb(out / "reconstruction.glb")
