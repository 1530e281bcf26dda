"""A still life on a checkerboard: vase, bowl of fruit, candlestick, glossy spheres; three lights."""

from math import cos, pi, sin

import numpy as np

from blend import (
    add,
    base_texture,
    bevelled,
    camera,
    export_gltf,
    image,
    light,
    material,
    mesh,
    new_scene,
    place,
)
from files import folder, png, write
from shapes import box, cylinder, grid, join, lathe, smooth_profile, sphere

out = folder("still-life")
new_scene(1280, 720)

# The floor: 2 × 2 fields to a texture, 12 × 10 fields of half a metre; a thin joint between them.
size = 128
y, x = np.mgrid[0:size, 0:size]
light_field = ((x // 64 + y // 64) % 2 == 0)[..., None]
grain = np.random.default_rng(7).integers(-5, 6, (size // 4, size // 4, 1)).repeat(4, 0).repeat(4, 1)
colours = np.where(light_field, (226, 211, 184), (74, 52, 44)) + grain
joint = ((x % 64 < 1) | (y % 64 < 1))[..., None]
write(out / "checker.png", png(np.where(joint, (120, 104, 88), colours).clip(0, 255).astype(np.uint8)))

floor = material("Checkerboard", roughness=0.35)
base_texture(floor, image(out / "checker.png"))
shape = grid(9, 8)
shape.uvs = [[(u * 9, v * 8) for u, v in face] for face in shape.uvs]
add("Floor", shape, floor, (0, 0.6, 0), (0, 0, 0))
add("Wall", grid(14, 5), material("Wall", "#7d9a99", 0.9), (0, 3.1, 2.5), (90, 0, 0))

glaze = material("Blue glaze", "#1d4f91", 0.22)
cream = material("Cream glaze", "#efe3c8", 0.3)
terracotta = material("Terracotta", "#b5573a", 0.75)
gold = material("Gold", (1.0, 0.71, 0.29), 0.38, 1.0)
copper = material("Copper", (0.95, 0.54, 0.37), 0.45, 1.0)
steel = material("Steel", (0.86, 0.86, 0.88), 0.45, 1.0)
stem = material("Stem", "#4a3420", 0.8)

# The vase, with a wall that is seen at its mouth.
outside = smooth_profile(
    [(0.30, 0.0), (0.34, 0.06), (0.50, 0.42), (0.56, 0.80), (0.42, 1.22), (0.22, 1.52), (0.20, 1.72), (0.30, 1.92)]
)
inside = smooth_profile([(0.275, 1.92), (0.175, 1.70), (0.19, 1.52), (0.38, 1.20), (0.5, 0.8), (0.3, 0.1)], 3)
vase = lathe([(0, 0), *outside, *inside, (0, 0.1)], 52)
place("Vase", mesh("Vase", vase, glaze, 60), (-1.02, 0.95, 0))
band = smooth_profile([(0.552, 0.70), (0.572, 0.74), (0.572, 0.82), (0.545, 0.88)], 4)
add("Vase band", lathe(band, 52), gold, (-1.02, 0.95, 0), smooth=60)


def tube(points, r0, r1, n=10):
    """A twig: rings round the points, thinner towards the end."""
    parts = []
    for k, (a, b) in enumerate(zip(points, points[1:])):
        t0, t1 = k / (len(points) - 1), (k + 1) / (len(points) - 1)
        seg = lathe([(0, 0), (r0 + (r1 - r0) * t0, 0), (r0 + (r1 - r0) * t1, 1), (0, 1)], n)
        parts.append(seg.map(lambda x, y, z, a=a, b=b: tuple(p + (q - p) * z + s for p, q, s in zip(a, b, (x, y, 0)))))
    return join(*parts)


# Three twigs with berries: one berry mesh, many objects.
berry = mesh("Berry", sphere(0.075, 20, 10), material("Berry", "#c5221f", 0.25), 180)
for k, (angle, reach, height) in enumerate(((-0.5, 0.66, 2.3), (1.9, 0.5, 2.45), (3.5, 0.6, 2.2))):
    points = [
        (reach * t * t * cos(angle), reach * t * t * sin(angle), 0.6 + (height - 0.6) * t)
        for t in (i / 8 for i in range(9))
    ]
    add(f"Twig {k + 1}", tube(points, 0.022, 0.012), stem, (-1.02, 0.95, 0), smooth=60)
    for i in range(5):
        px, py, pz = points[4 + i]
        side = 0.085 * (-1) ** i
        place(f"Berry {k + 1}.{i + 1}", berry, (-1.02 + px - side * sin(angle), 0.95 + py + side * cos(angle), pz))

# The bowl and the fruit in it.
bowl_at = (0.78, 0.62, 0)
bowl = lathe(
    [
        (0, 0),
        *smooth_profile([(0.34, 0), (0.34, 0.05), (0.26, 0.09), (0.52, 0.24), (0.76, 0.52)], 6),
        *smooth_profile([(0.72, 0.525), (0.48, 0.27), (0.2, 0.15)], 5),
        (0, 0.14),
    ],
    72,
)
add("Bowl", bowl, cream, bowl_at, smooth=50)

orange = lathe(
    [(0, -0.25), *[(0.26 * sin(pi * i / 20), -0.25 * cos(pi * i / 20)) for i in range(1, 20)], (0, 0.24)], 36
)
orange_skin = mesh("Orange", orange, material("Orange", "#f07a12", 0.42), 180)
for k, (dx, dy, dz) in enumerate(
    ((-0.3, -0.12, 0.52), (0.14, -0.34, 0.53), (0.27, 0.2, 0.54), (-0.14, 0.28, 0.53), (0.0, -0.03, 0.84))
):
    place(f"Orange {k + 1}", orange_skin, (bowl_at[0] + dx, bowl_at[1] + dy, dz), (17 * k, 31 * k, 0))

apple_profile = smooth_profile(
    [(0, 0.035), (0.07, 0.0), (0.19, 0.05), (0.275, 0.22), (0.25, 0.40), (0.14, 0.485), (0.05, 0.455), (0, 0.40)], 5
)
apple = mesh("Apple", lathe(apple_profile, 40), material("Apple", "#a8141c", 0.24), 180)
pear_profile = smooth_profile(
    [
        (0, 0.02),
        (0.1, 0.0),
        (0.245, 0.1),
        (0.29, 0.27),
        (0.22, 0.48),
        (0.125, 0.64),
        (0.1, 0.74),
        (0.05, 0.79),
        (0, 0.79),
    ],
    5,
)
pear = mesh("Pear", lathe(pear_profile, 40), material("Pear", "#b9b534", 0.4), 180)
lemon = mesh(
    "Lemon",
    lathe(
        smooth_profile([(0, -0.3), (0.04, -0.28), (0.13, -0.2), (0.2, 0), (0.13, 0.2), (0.04, 0.28), (0, 0.3)], 6), 36
    ),
    material("Lemon", "#f2cf1d", 0.38),
    180,
)
stalk = mesh("Stalk", lathe([(0, 0), (0.014, 0), (0.022, 0.17), (0, 0.17)], 10), stem, 40)


def fruit(name, data, at, tilt, stalk_at):
    obj = place(name, data, at, tilt)
    place(name + " stalk", stalk, (0, 0, stalk_at), (6, 9, 0), parent=obj)


fruit("Apple 1", apple, (-0.42, -0.62, 0), (0, 0, 0), 0.4)
fruit("Apple 2", apple, (1.78, 0.1, 0.028), (-14, 10, 50), 0.4)
fruit("Pear 1", pear, (-0.02, 0.22, 0), (0, -4, 0), 0.76)
place("Lemon 1", lemon, (0.16, -0.88, 0.2), (90, 0, 62))
place("Lemon 2", lemon, (1.33, -0.62, 0.2), (90, 0, -35))

# A candlestick with its candle.
stick = smooth_profile(
    [
        (0.27, 0),
        (0.28, 0.04),
        (0.2, 0.08),
        (0.07, 0.14),
        (0.05, 0.22),
        (0.09, 0.3),
        (0.05, 0.38),
        (0.045, 0.72),
        (0.08, 0.78),
        (0.045, 0.84),
        (0.16, 0.92),
        (0.165, 0.96),
    ],
    5,
)
add("Candlestick", lathe([(0, 0), *stick, (0, 0.945)], 48), gold, (1.62, 1.25, 0), smooth=50)
add("Candle", cylinder(0.075, 0.75, 32, 0.015), material("Wax", "#f4ead2", 0.55), (1.62, 1.25, 0.945), smooth=40)
add("Wick", cylinder(0.008, 0.07, 8), stem, (1.62, 1.25, 1.69))

# Spheres of several roughnesses; they share one mesh per size, the material is the object's.
ball = mesh("Ball", sphere(1, 48, 24), steel, 180)


def sphere_at(name, x, y, r, mat):
    obj = place(name, ball, (x, y, r), scale=(r, r, r))
    obj.material_slots[0].link = "OBJECT"
    obj.material_slots[0].material = mat


sphere_at("Steel sphere", -1.72, -0.12, 0.36, steel)
sphere_at("Jade sphere", -1.05, -0.42, 0.22, material("Jade", "#1f8a5b", 0.18))
sphere_at("Copper sphere", 0.78, -0.62, 0.24, copper)
sphere_at("Violet sphere", -0.95, -1.05, 0.15, material("Violet", "#5b2a86", 0.12))
sphere_at("Chalk sphere", 0.52, -1.12, 0.13, material("Chalk", "#e8e4dc", 0.95))
sphere_at("Ruby sphere", 1.98, -0.62, 0.19, material("Ruby", "#8e0f3a", 0.15))

# A book with a small pot on it, at the left edge.
bevelled(
    "Book",
    box(0.95, 0.66, 0.13),
    material("Book cloth", "#7a2f24", 0.7),
    0.012,
    location=(-1.98, 0.62, 0.065),
    rotation=(0, 0, 24),
)
add(
    "Terracotta pot",
    lathe([(0, 0), (0.17, 0), (0.22, 0.3), (0.245, 0.3), (0.25, 0.37), (0.215, 0.37), (0.19, 0.05), (0, 0.05)], 48),
    terracotta,
    (-2.02, 0.64, 0.13),
    smooth=35,
)

light("Key", "SPOT", (-3.6, -3.4, 4.6), 2400, (0.1, 0.3, 0.45), "#ffd9a8", cone=50, blend=0.4, radius=0.06)
light("Fill", "POINT", (3.4, -3.2, 2.4), 200, color="#ffe9d2", radius=0.1)
light("Window", "SUN", (2, 0, 4), 0.8, (0.6, 1.6, 0), "#c9dcff")
camera("Camera", (-0.55, -7.3, 2.7), (-0.03, 0.3, 1.0), fov=42)

export_gltf(out / "still-life.glb")
