"""The meshes of the fixtures: a torus with every attribute, a wavy patch with morph targets, a box, a strip."""

from math import cos, pi, sin, sqrt


def unit(v):
    n = sqrt(sum(c * c for c in v)) or 1.0
    return tuple(c / n for c in v)


def torus(rings=8, sides=6, R=1.0, r=0.35):
    """A torus with UV seams in both directions (vertices on the seams are doubled): genus 1 for Draco."""
    v = {"POSITION": [], "NORMAL": [], "TANGENT": [], "TEXCOORD_0": [], "TEXCOORD_1": [], "COLOR_0": [], "t": []}
    for i in range(rings + 1):
        a = 2 * pi * (i % rings) / rings
        for j in range(sides + 1):
            b = 2 * pi * (j % sides) / sides
            v["POSITION"].append(((R + r * cos(b)) * cos(a), r * sin(b), -(R + r * cos(b)) * sin(a)))
            v["NORMAL"].append(unit((cos(b) * cos(a), sin(b), -cos(b) * sin(a))))
            v["TANGENT"].append((-sin(a), 0.0, -cos(a), 1.0 if j % 2 else -1.0 if i == 3 else 1.0))
            v["TEXCOORD_0"].append((i / rings, 1 - j / sides))
            v["TEXCOORD_1"].append((-0.5 + 3 * i / rings, 2.5 * j / sides))
            v["COLOR_0"].append(
                (round(127 + 127 * cos(a)), round(127 + 127 * sin(b)), round(255 * j / sides), 255 - 40 * (i % 3))
            )
            v["t"].append((1 + cos(a)) / 2)
    triangles = []
    for i in range(rings):
        for j in range(sides):
            p, q = i * (sides + 1) + j, (i + 1) * (sides + 1) + j
            triangles += [(p, q, p + 1), (p + 1, q, q + 1)]
    return v, triangles


def patch(nx=9, nz=7, size=2.0, height=lambda u, v: 0.2 * sin(5 * u) * cos(4 * v)):
    """An open patch over x and z, normals by differences."""
    out = {"POSITION": [], "NORMAL": [], "TEXCOORD_0": []}
    h = 1e-3
    for j in range(nz):
        for i in range(nx):
            u, v = i / (nx - 1), j / (nz - 1)
            out["POSITION"].append((size * (u - 0.5), height(u, v), size * (v - 0.5)))
            du = (height(u + h, v) - height(u - h, v)) / (2 * h * size)
            dv = (height(u, v + h) - height(u, v - h)) / (2 * h * size)
            out["NORMAL"].append(unit((-du, 1, -dv)))
            out["TEXCOORD_0"].append((u, v))
    triangles = []
    for j in range(nz - 1):
        for i in range(nx - 1):
            a = j * nx + i
            triangles += [(a, a + nx, a + 1), (a + 1, a + nx, a + nx + 1)]
    return out, triangles


def box(x=1.0, y=1.0, z=1.0):
    """24 vertices, flat normals, UVs per face."""
    out = {"POSITION": [], "NORMAL": [], "TEXCOORD_0": []}
    triangles = []
    for axis in range(3):
        for sign in (1, -1):
            n = [0, 0, 0]
            n[axis] = sign
            u, w = (axis + 1) % 3, (axis + 2) % 3
            first = len(out["POSITION"])
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                p = [0, 0, 0]
                p[axis], p[u], p[w] = sign, a * sign, b
                out["POSITION"].append(tuple(c * s / 2 for c, s in zip(p, (x, y, z))))
                out["NORMAL"].append(tuple(map(float, n)))
                out["TEXCOORD_0"].append(((a + 1) / 2, (1 - b) / 2))
            triangles += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return out, triangles


def strip(n=10):
    """A band: vertices in strip order; returns attributes, strip indices, the same triangles as a list."""
    out = {"POSITION": [], "NORMAL": []}
    for i in range(n + 1):
        a = pi * i / n
        for y in (0.6 + 0.02 * i, 0.0):
            out["POSITION"].append((cos(a), y, -sin(a)))
            out["NORMAL"].append(unit((cos(a), 0, -sin(a))))
    indices = list(range(2 * (n + 1)))
    triangles = [(k, k + 1, k + 2) if k % 2 == 0 else (k + 1, k, k + 2) for k in range(len(indices) - 2)]
    return out, indices, triangles


def flat(triangles):
    return [i for t in triangles for i in t]
