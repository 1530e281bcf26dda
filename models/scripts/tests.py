"""The smallest files, for tests: models/tests/. Plain Python, no Blender."""

from math import pi

from files import Gltf, folder, look_at, obj_object, png, write
from shapes import Shape, box, grid, icosphere

out = folder("tests")

TRIANGLE = Shape([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])


def triangle():
    gltf = Gltf()
    material = gltf.material("Orange", (0.9, 0.4, 0.1))
    gltf.node("Triangle", mesh=gltf.mesh("Triangle", TRIANGLE, material, [(0, 0, 1)] * 3))
    return gltf


triangle().write_embedded(out / "triangle.gltf")
triangle().write_glb(out / "triangle.glb")

# A unit square without indices, normals or material: six vertices in z = 0.
quad = Gltf()
corners = [(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)]
position = quad.floats(corners, bounds=True)
quad.node("Quad", mesh=quad.add("meshes", {"name": "Quad", "primitives": [{"attributes": {"POSITION": position}}]}))
quad.write_glb(out / "quad_nonindexed.glb")

# A cube of side 2, quads, nothing but v and f.
lines = []
obj_object(lines, "cube", Shape(box(2, 2, 2).verts, box(2, 2, 2).faces))
write(out / "cube.obj", "\n".join(lines[1:]) + "\n")

# Negative indices between the vertices they point back to; a 4 × 4 texture.
write(
    out / "negative.obj",
    """mtllib negative.mtl
usemtl checker
v -1 0 0
v 0 0 0
v 0 1 0
v -1 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f -4/-4 -3/-3 -2/-2 -1/-1
v 0 0 0
v 1 0 0
v 1 1 0
f -3/-4 -2/-3 -1/-2
v 0 1 0
vt 0 1
f -4/-5 -2/-3 -1/-1
""",
)
write(out / "negative.mtl", "newmtl checker\nKd 1 1 1\nmap_Kd negative.png\n")
write(
    out / "negative.png", png([[(220, 40, 40) if (i + j) % 2 else (240, 240, 240) for i in range(4)] for j in range(4)])
)

# Every kind of light and camera, each on its own node; a floor and a ball with smooth normals.
lights = Gltf()
grey, blue = lights.material("Grey", (0.6, 0.6, 0.6), 0, 1), lights.material("Blue", (0.1, 0.3, 0.8), 0, 0.3)
lights.node("Floor", mesh=lights.mesh("Floor", grid(6, 6).y_up(), grey, [(0, 1, 0)] * 4))
ball = icosphere(1, 2)
lights.node("Ball", translation=[0, 1, 0], mesh=lights.mesh("Ball", ball, blue, ball.verts))
lights.node(
    "Point node",
    translation=[-2, 3, 2],
    extensions=lights.light(type="point", name="Point", color=[1, 0.9, 0.8], intensity=60, range=20),
)
lights.node(
    "Spot node",
    **look_at((2.5, 3.5, 1.5), (-2.5, -2.5, -1.5)),
    extensions=lights.light(
        type="spot",
        name="Spot",
        color=[0.8, 0.9, 1],
        intensity=90,
        spot={"innerConeAngle": pi / 12, "outerConeAngle": pi / 7},
    ),
)
lights.node(
    "Sun node",
    **look_at((0, 5, 0), (0.3, -1, -0.4)),
    extensions=lights.light(type="directional", name="Sun", color=[1, 1, 1], intensity=1),
)
perspective = lights.add(
    "cameras",
    {
        "type": "perspective",
        "name": "Perspective",
        "perspective": {"aspectRatio": 16 / 9, "yfov": pi / 4, "znear": 0.1, "zfar": 100},
    },
)
orthographic = lights.add(
    "cameras",
    {
        "type": "orthographic",
        "name": "Orthographic",
        "orthographic": {"xmag": 3.2, "ymag": 1.8, "znear": 0.1, "zfar": 100},
    },
)
lights.node("Perspective node", camera=perspective, **look_at((0, 2.5, 6), (0, -1.6, -6)))
lights.node("Orthographic node", camera=orthographic, **look_at((4, 4, 4), (-4, -3.2, -4)))
lights.write_glb(out / "lights.glb")

# A closed ball of 5,120 triangles, every vertex shared.
lines = []
obj_object(lines, "closed_sphere", icosphere(1, 4))
write(out / "closed_sphere.obj", "\n".join(lines) + "\n")
