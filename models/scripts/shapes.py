"""Plain geometry, no Blender needed: every function returns a Shape.

A Shape is vertices, faces (any number of corners, counter-clockwise seen from
outside) and, where it has them, one (u, v) per face corner. +Z is up.
"""

from dataclasses import dataclass, field
from math import acos, atan2, cos, hypot, pi, sin, sqrt, tan


@dataclass
class Shape:
    verts: list = field(default_factory=list)
    faces: list = field(default_factory=list)
    uvs: list | None = None

    def map(self, f):
        """The same faces with every vertex moved by f."""
        return Shape([tuple(f(*p)) for p in self.verts], self.faces, self.uvs)

    def moved(self, dx, dy, dz):
        return self.map(lambda x, y, z: (x + dx, y + dy, z + dz))

    def scaled(self, sx, sy, sz):
        return self.map(lambda x, y, z: (x * sx, y * sy, z * sz))

    def y_up(self):
        """From Blender's frame (+Z up) to that of glTF (+Y up)."""
        return self.map(lambda x, y, z: (x, z, -y))

    def triangles(self):
        """Index triples; polygons are cut as fans."""
        return [(f[0], f[k], f[k + 1]) for f in self.faces for k in range(1, len(f) - 1)]


def join(*shapes):
    """One Shape of several."""
    out = Shape(uvs=[] if all(s.uvs is not None for s in shapes) else None)
    for s in shapes:
        n = len(out.verts)
        out.verts += s.verts
        out.faces += [tuple(i + n for i in f) for f in s.faces]
        if out.uvs is not None:
            out.uvs += s.uvs
    return out


def box(sx, sy, sz):
    """Centred on the origin, with sizes sx, sy, sz; each side has the whole texture."""
    x, y, z = sx / 2, sy / 2, sz / 2
    verts = [(a, b, c) for c in (-z, z) for b in (-y, y) for a in (-x, x)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (3, 2, 6, 7), (2, 0, 4, 6), (1, 3, 7, 5)]
    return Shape(verts, faces, [[(0, 0), (1, 0), (1, 1), (0, 1)]] * 6)


def grid(sx, sy, nx=1, ny=1):
    """A flat rectangle in z = 0, facing +Z, its texture filling it once."""
    verts = [(sx * (i / nx - 0.5), sy * (j / ny - 0.5), 0) for j in range(ny + 1) for i in range(nx + 1)]
    faces, uvs, row = [], [], nx + 1
    for j in range(ny):
        for i in range(nx):
            k = j * row + i
            faces.append((k, k + 1, k + 1 + row, k + row))
            u0, u1, v0, v1 = i / nx, (i + 1) / nx, j / ny, (j + 1) / ny
            uvs.append([(u0, v0), (u1, v0), (u1, v1), (u0, v1)])
    return Shape(verts, faces, uvs)


def lathe(profile, n=48, sweep=2 * pi, start=0.0, closed=False):
    """Turns a profile [(r, z), …], given from bottom to top, about the Z axis.

    A point with r = 0 is a pole. `closed` joins the last point to the first (a
    ring; counter-clockwise in (r, z)); a closed profile swept less than once
    round gets a flat cap at both ends.
    """
    full = abs(sweep - 2 * pi) < 1e-9
    columns = n if full else n + 1
    ring, verts = [], []
    for r, z in profile:
        if r == 0:
            ring.append([len(verts)] * (n + 1))
            verts.append((0, 0, z))
            continue
        first = len(verts)
        for j in range(columns):
            a = start + sweep * j / n
            verts.append((r * cos(a), r * sin(a), z))
        ring.append([first + j % columns for j in range(n + 1)])

    along = [0.0]
    loop = profile + profile[:1] if closed else profile
    for (r0, z0), (r1, z1) in zip(loop, loop[1:]):
        along.append(along[-1] + hypot(r1 - r0, z1 - z0))
    if closed:
        ring.append(ring[0])

    faces, uvs = [], []
    for i in range(len(ring) - 1):
        v0, v1 = along[i] / along[-1], along[i + 1] / along[-1]
        for j in range(n):
            u0, u1 = j / n, (j + 1) / n
            face, uv = [], []
            for corner, t in (
                (ring[i][j], (u0, v0)),
                (ring[i][j + 1], (u1, v0)),
                (ring[i + 1][j + 1], (u1, v1)),
                (ring[i + 1][j], (u0, v1)),
            ):
                if corner not in face:
                    face.append(corner)
                    uv.append(t)
            if len(face) > 2:
                faces.append(tuple(face))
                uvs.append(uv)
    if closed and not full:
        for j, flip in ((0, False), (n, True)):
            cap = [ring[i][j] for i in range(len(profile))]
            faces.append(tuple(reversed(cap)) if flip else tuple(cap))
            uvs.append([(0, 0)] * len(cap))
    return Shape(verts, faces, uvs)


def sphere(r=1.0, n=48, rings=24):
    """With poles and UVs."""
    profile = [(r * sin(pi * i / rings), -r * cos(pi * i / rings)) for i in range(1, rings)]
    return lathe([(0, -r), *profile, (0, r)], n)


def icosphere(r=1.0, splits=3):
    """20·4^splits triangles, closed, every vertex shared."""
    g = (1 + sqrt(5)) / 2
    verts = [
        (-1, g, 0),
        (1, g, 0),
        (-1, -g, 0),
        (1, -g, 0),
        (0, -1, g),
        (0, 1, g),
        (0, -1, -g),
        (0, 1, -g),
        (g, 0, -1),
        (g, 0, 1),
        (-g, 0, -1),
        (-g, 0, 1),
    ]
    faces = [
        (0, 11, 5),
        (0, 5, 1),
        (0, 1, 7),
        (0, 7, 10),
        (0, 10, 11),
        (1, 5, 9),
        (5, 11, 4),
        (11, 10, 2),
        (10, 7, 6),
        (7, 1, 8),
        (3, 9, 4),
        (3, 4, 2),
        (3, 2, 6),
        (3, 6, 8),
        (3, 8, 9),
        (4, 9, 5),
        (2, 4, 11),
        (6, 2, 10),
        (8, 6, 7),
        (9, 8, 1),
    ]
    for _ in range(splits):
        middle, finer = {}, []

        def halfway(a, b):
            key = (min(a, b), max(a, b))
            if key not in middle:
                middle[key] = len(verts)
                verts.append(tuple((p + q) / 2 for p, q in zip(verts[a], verts[b])))
            return middle[key]

        for a, b, c in faces:
            ab, bc, ca = halfway(a, b), halfway(b, c), halfway(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    return Shape([tuple(r * c / sqrt(x * x + y * y + z * z) for c in (x, y, z)) for x, y, z in verts], faces)


def cylinder(r, h, n=48, chamfer=0.0):
    """Standing on z = 0."""
    c = chamfer
    rim = [(r - c, 0), (r, c), (r, h - c), (r - c, h)] if c else [(r, 0), (r, h)]
    return lathe([(0, 0), *rim, (0, h)], n)


def ring(r_in, r_out, h, n=48, chamfer=0.0):
    """A tube or washer standing on z = 0."""
    c = chamfer
    if not c:
        return lathe([(r_in, 0), (r_out, 0), (r_out, h), (r_in, h)], n, closed=True)
    return lathe(
        [
            (r_in + c, 0),
            (r_out - c, 0),
            (r_out, c),
            (r_out, h - c),
            (r_out - c, h),
            (r_in + c, h),
            (r_in, h - c),
            (r_in, c),
        ],
        n,
        closed=True,
    )


def prism_with_bore(outline, bore, h, chamfer=0.0):
    """A plate of the outline [(x, y), …] (counter-clockwise) with a round hole, on z = 0."""
    n = len(outline)
    hole = []
    for x, y in outline:
        a = atan2(y, x)
        hole.append((bore * cos(a), bore * sin(a)))
    verts, levels = [], []

    def level(points, z):
        levels.append(len(verts))
        verts.extend((x, y, z) for x, y in points)

    inset = [(x * (1 - chamfer / hypot(x, y)), y * (1 - chamfer / hypot(x, y))) for x, y in outline]
    level(hole, 0)
    level(inset if chamfer else outline, 0)
    if chamfer:
        level(outline, chamfer)
        level(outline, h - chamfer)
    level(inset if chamfer else outline, h)
    level(hole, h)
    faces = []
    for a, b in zip(levels, levels[1:] + levels[:1]):
        faces += [(a + i, a + (i + 1) % n, b + (i + 1) % n, b + i) for i in range(n)]
    return Shape(verts, faces)


def gear_outline(teeth, module, pressure=pi / 9, steps=4, play=0.0):
    """Involute spur gear seen from above: pitch radius is module·teeth/2; `play` thins the teeth."""
    pitch = module * teeth / 2
    base, tip, root = pitch * cos(pressure), pitch + module, pitch - 1.25 * module
    half = pi / (2 * teeth) + tan(pressure) - pressure - play  # half a tooth's angle at the base circle

    def flank(r):
        """Angle from the tooth's middle to its flank at radius r."""
        a = acos(min(1, base / r))
        return half - (tan(a) - a)

    low = max(root, base)
    radii = [low + (tip - low) * k / steps for k in range(steps + 1)]
    points = []
    for t in range(teeth):
        mid = 2 * pi * t / teeth
        side = [(r, flank(r)) for r in radii]
        if root < base:  # below the base circle the flank widens a little towards the root
            side.insert(0, (root, flank(low) + 0.2 * (pi / teeth - flank(low))))
        points += [(r, mid - a) for r, a in side]
        points += [(r, mid + a) for r, a in reversed(side)]
    return [(r * cos(a), r * sin(a)) for r, a in points]


def hexagon(across_flats, per_side=4):
    """Counter-clockwise, every side cut into equal parts (for prism_with_bore)."""
    r = across_flats / sqrt(3)
    corner = [(r * cos(pi * k / 3), r * sin(pi * k / 3)) for k in range(7)]
    return [
        tuple(p + (q - p) * t / per_side for p, q in zip(corner[k], corner[k + 1]))
        for k in range(6)
        for t in range(per_side)
    ]


def smooth_profile(points, per_span=6):
    """A Catmull-Rom curve through the points of a lathe's profile."""
    p = [points[0], *points, points[-1]]
    out = []
    for a, b, c, d in zip(p, p[1:], p[2:], p[3:]):
        for k in range(per_span):
            t = k / per_span
            out.append(
                tuple(
                    0.5 * (2 * y + (z - x) * t + (2 * x - 5 * y + 4 * z - w) * t * t + (3 * y - x - 3 * z + w) * t**3)
                    for x, y, z, w in zip(a, b, c, d)
                )
            )
    return [(0 if r < 1e-9 else r, z) for r, z in out + [points[-1]]]
