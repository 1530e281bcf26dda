"""Leaves cut by a MASK texture, two BLEND glass panes one behind the other, vertex colours, two kinds of camera."""

from math import cos, pi

import numpy as np

from blend import add, bevelled, camera, export_gltf, image, light, material, mesh, new_scene, place, texture
from files import folder, png, write
from shapes import box, cylinder, grid, lathe, smooth_profile, sphere

out = folder("alpha")
new_scene(960, 540)

# The leaf: stem at the bottom, tip at the top, alpha outside its outline 0.
S = 256
row, col = np.mgrid[0:S, 0:S]
x, y = (col + 0.5) / S * 2 - 1, 1 - (row + 0.5) / S
half = 0.9 * np.sin(np.pi * np.clip((y - 0.16) / 0.82, 0, 1) ** 0.8) ** 1.1 * (1 - 0.35 * y)
half = half * (1 + 0.07 * np.sin(y * 60))  # a toothed edge
vein = (abs(x) < 0.02 + 0.02 * (1 - y)) | ((abs(((y - 0.45 * abs(x)) * 9) % 1 - 0.5) < 0.06) & (abs(x) < half - 0.06))
inside = (abs(x) < half) | ((abs(x) < 0.035) & (y < 0.25))
rgb = (
    np.where(vein[..., None], (150, 186, 84), (62, 128, 44))
    * (0.8 + 0.2 * (1 - abs(x) / np.maximum(half, 0.05)).clip(0, 1))[..., None]
)
leaf_png = np.concatenate([rgb, np.where(inside, 255, 0)[..., None]], -1).clip(0, 255).astype(np.uint8)
write(out / "leaf.png", png(leaf_png))

leaf = material("Leaf", roughness=0.5)
node, principled, links = texture(leaf, image(out / "leaf.png"), "EXTEND")
links.new(node.outputs["Color"], principled.inputs["Base Color"])
cut = leaf.node_tree.nodes.new("ShaderNodeMath")  # rounded alpha is how Blender says MASK at one half
cut.operation = "ROUND"
links.new(node.outputs["Alpha"], cut.inputs[0])
links.new(cut.outputs[0], principled.inputs["Alpha"])

# A plant: one leaf mesh, bent a little, eleven times.
blade = grid(0.55, 0.8, 2, 6).moved(0, 0.4, 0).map(lambda x, y, z: (x, y, 0.22 * x * x - 0.3 * y * y))
leaf_mesh = mesh("Leaf", blade, leaf, 180)
plant = place("Plant", None, (-1.25, 0.25, 0))
add(
    "Stem",
    lathe([(0, 0), (0.035, 0), (0.02, 1.55), (0, 1.55)], 12),
    material("Stem", "#4d6b2c", 0.7),
    parent=plant,
    smooth=60,
)
for k in range(11):
    turn = 137.5 * k
    place(f"Leaf {k + 1}", leaf_mesh, (0, 0, 0.5 + 0.1 * k), (52 - 3 * k, 0, turn), (1.1 - 0.04 * k,) * 3, parent=plant)

# Vertex colours: a pot and a striped ball, by a colour attribute read by the material.
painted = material("Vertex colours", roughness=0.35)
attribute = painted.node_tree.nodes.new("ShaderNodeVertexColor")
attribute.layer_name = "Colour"
painted.node_tree.links.new(attribute.outputs["Color"], painted.node_tree.nodes["Principled BSDF"].inputs["Base Color"])


def paint(obj, colour_at):
    layer = obj.data.color_attributes.new("Colour", "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", [c for v in obj.data.vertices for c in (*colour_at(*v.co), 1)])
    obj.data.color_attributes.active_color = layer


def rainbow(x, y, z, turns=1.0):
    return tuple(0.5 + 0.45 * cos(2 * pi * (turns * z - k / 3)) for k in range(3))


pot = add(
    "Pot",
    lathe(
        [
            (0, 0),
            *smooth_profile([(0.24, 0), (0.34, 0.2), (0.36, 0.42), (0.42, 0.5)], 5),
            (0.37, 0.5),
            (0.3, 0.4),
            (0, 0.4),
        ],
        48,
    ),
    painted,
    (-1.25, 0.25, 0),
    smooth=40,
)
paint(pot, lambda x, y, z: (0.75, 0.25 + 0.6 * z, 0.12))
globe = add("Ball", sphere(0.36, 48, 24), painted, (1.12, 0.35, 0.36), smooth=180)
paint(globe, rainbow)

# Two panes on feet; behind each other they mix.
for name, colour, at, turn in (
    ("Red glass", "#d8341f", (0.2, -0.25, 0.75), -18),
    ("Blue glass", "#2458d6", (0.62, 0.12, 0.75), 14),
):
    glass = material(name, colour, 0.12, alpha=0.4)
    pane = add(name, box(0.95, 0.03, 1.3), glass, at, (0, 0, turn))
    bevelled(
        name + " foot",
        box(1.0, 0.2, 0.1),
        material(name + " foot", "#c9c2b4", 0.6),
        0.02,
        location=(at[0], at[1], 0.05),
        rotation=(0, 0, turn),
    )
add("White post", cylinder(0.12, 1.2, 32, 0.01), material("White", "#eeeeea", 0.6), (0.5, 0.85, 0), smooth=40)

add("Floor", grid(9, 7), material("Floor", "#b9b2a4", 0.85), (0, 0.5, 0))
add("Wall", grid(9, 3.5), material("Wall", "#8d97a3", 0.9), (0, 2.4, 1.75), (90, 0, 0))

light("Point", "POINT", (-2.6, -2.2, 2.8), 330, color="#ffe8cc", radius=0.03)
light("Spot", "SPOT", (2.4, -2.6, 3.2), 600, (0.3, 0.2, 0.4), "#e4edff", cone=42, blend=0.25, radius=0.03)
camera("Perspective", (-0.1, -4.6, 1.7), (-0.1, 0.2, 0.78), fov=42)
camera("Orthographic", (-4, -6, 4.2), (-0.05, 0.3, 0.7), ortho=4.6)

export_gltf(out / "alpha.glb")
