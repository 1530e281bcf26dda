"""A box with a red and a green wall, two blocks, one glossy sphere and a lamp: cornell.glb, cornell.obj.

The room is 4 m wide, deep and high; its open side looks towards −Y (glTF: +Z).
"""

from math import radians

from blend import add, bevelled, camera, export_gltf, export_obj, light, material, new_scene
from files import folder
from shapes import Shape, box, grid, sphere

from mathutils import Euler, Vector  # isort: skip (bpy, which blend imports, provides it)

out = folder("cornell")
new_scene(720, 720)

white = material("White", (0.73, 0.73, 0.73), 0.9)
red = material("Red", (0.63, 0.065, 0.05), 0.9)
green = material("Green", (0.14, 0.45, 0.091), 0.9)
glossy = material("Glossy blue", (0.05, 0.16, 0.42), 0.2)
panel = material("Lamp", (0.8, 0.8, 0.8), 0.9, emission=("#fff1dc", 4))



def wall(name, mat, location=(0, 0, 0), rotation=(0, 0, 0)):
    """Adds a square of 4 m with its rotation applied to the vertices.

    Walls then share their corners to the last bit. Nodes with rounded quaternions would leave gaps between them,
    through which light leaks.
    """
    turn = Euler([radians(a) for a in rotation]).to_matrix()
    flat = grid(4, 4)
    verts = [tuple(round(c, 6) + 0.0 for c in turn @ Vector(v) + Vector(location)) for v in flat.verts]
    add(name, Shape(verts, flat.faces, flat.uvs), mat)


wall("Floor", white)
wall("Ceiling", white, (0, 0, 4), (180, 0, 0))
wall("Back wall", white, (0, 2, 2), (90, 0, 0))
wall("Left wall", red, (-2, 0, 2), (0, 90, 0))
wall("Right wall", green, (2, 0, 2), (0, -90, 0))
add("Lamp panel", box(1, 0.8, 0.04), panel, (0, -1.1, 3.98))

bevelled("Tall block", box(1.15, 1.15, 2.3), white, 0.02, location=(-0.7, 0.8, 1.15), rotation=(0, 0, 18))
bevelled("Short block", box(1.1, 1.1, 1.1), white, 0.02, location=(0.72, 0.1, 0.55), rotation=(0, 0, -17))
add("Sphere", sphere(0.5, 64, 32), glossy, (-0.5, -0.75, 0.5), smooth=180)

light("Lamp light", "POINT", (0, -1.1, 3.35), 300, color="#fff1dc", radius=0.1)
camera("Camera", (0, -8.6, 2), (0, 0, 2), fov=36)

export_gltf(out / "cornell.glb")
export_obj(out / "cornell.obj")
