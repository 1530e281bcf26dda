"""A bar: glasses with and without drinks, a shaker of brushed steel, copper and gold, a lacquered box."""

from math import cos, pi, sin

import numpy as np

from blend import add, base_texture, bevelled, camera, export_gltf, image, light, material, new_scene
from files import folder, png, write
from shapes import box, grid, lathe, smooth_profile, sphere

out = folder("bar")
new_scene(1280, 720)


def principled(mat, **inputs):
    """Sets further inputs of a material's shader."""
    for name, value in inputs.items():
        mat.node_tree.nodes["Principled BSDF"].inputs[name.replace("_", " ")].default_value = value
    return mat


def glass(name, color="#ffffff", ior=1.5, roughness=0.0):
    return principled(material(name, color, roughness), Transmission_Weight=1.0, IOR=ior)


# The counter: planks of dark wood with a satin varnish.
size = 512
y, x = np.mgrid[0:size, 0:size] / size
random = np.random.default_rng(5)
plank = np.floor(y * 4)
tone = random.uniform(-0.12, 0.12, 4)[plank.astype(int)]
rings = sum(np.sin(2 * pi * (f * y + a * np.sin(2 * pi * (x + p)))) / f for f, a, p in ((12, 0.12, 0.1), (28, 0.2, 0.6), (60, 0.15, 0.3)))
grain = random.normal(0, 0.02, (size, size // 16)).repeat(16, 1)
value = (0.72 + tone + 1.1 * rings + grain)[..., None]
value = np.where(((y * 4) % 1 < 0.012)[..., None], 0.35, value)
write(out / "wood.png", png((value * (84, 52, 34)).clip(0, 255).astype(np.uint8)))
wood = principled(material("Wood", roughness=0.35), Coat_Weight=0.6, Coat_Roughness=0.08)
base_texture(wood, image(out / "wood.png"))
counter = grid(12, 8)
counter.uvs = [[(u * 4, v * 2.7) for u, v in face] for face in counter.uvs]
add("Counter", counter, wood, (0, 1, 0))
add("Wall", grid(16, 6), material("Wall", "#2f4a4d", 0.85), (0, 4.2, 3), (90, 0, 0))

clear = glass("Glass")
steel = material("Brushed steel", (0.72, 0.71, 0.69), 0.3, 1.0)
chrome = material("Chrome", (0.8, 0.8, 0.8), 0.0, 1.0)
copper = material("Copper", (0.93, 0.55, 0.41), 0.18, 1.0)
gold = material("Gold", (1.0, 0.74, 0.32), 0.08, 1.0)


def vessel(name, outside, inside, mat, at, segments=72):
    """A vessel with a wall: its outside from the middle of the foot up to the rim, its inside down to the middle."""
    profile = [(0, outside[0][1]), *smooth_profile(outside, 5), *smooth_profile(inside, 5), (0, inside[-1][1])]
    return add(name, lathe(profile, segments), mat, at, smooth=50)


def drink(name, profile, mat, at, segments=72):
    """A liquid; it reaches a little into the wall of its glass, so that no air is between them."""
    return add(name, lathe([(0, profile[0][1]), *profile, (0, profile[-1][1])], segments), mat, at, smooth=50)


# A wine glass, a third full.
wine_at = (-0.98, -0.1, 0)
bowl_outside = [(0.09, 0.98), (0.3, 1.13), (0.43, 1.42), (0.42, 1.75), (0.35, 2.08)]
vessel(
    "Wine glass",
    [(0.37, 0.0), (0.375, 0.02), (0.2, 0.055), (0.05, 0.14), (0.036, 0.5), (0.045, 0.9), *bowl_outside],
    [(0.338, 2.085), (0.405, 1.75), (0.412, 1.42), (0.285, 1.15), (0.1, 1.03), (0.02, 1.02)],
    clear,
    wine_at,
)
red = glass("Red wine", "#8c0f1f", 1.345)
drink("Wine", smooth_profile([(0.03, 1.012), (0.11, 1.022), (0.293, 1.143), (0.402, 1.36), (0.4195, 1.5)], 5), red, wine_at)

# A tumbler of water with a straw of gold.
tumbler_at = (0.12, -0.72, 0)
vessel(
    "Tumbler",
    [(0.33, 0.0), (0.345, 0.02), (0.36, 0.3), (0.385, 0.86)],
    [(0.368, 0.868), (0.345, 0.4), (0.33, 0.16), (0.3, 0.12), (0.02, 0.115)],
    clear,
    tumbler_at,
)
water = glass("Water", "#f4fbff", 1.33)
drink("Water", smooth_profile([(0.03, 0.108), (0.305, 0.112), (0.337, 0.17), (0.352, 0.4), (0.362, 0.6)], 5), water, tumbler_at)

# A carafe of frosted, faintly green glass.
frosted = glass("Frosted glass", "#d5eedd", 1.5, 0.28)
vessel(
    "Carafe",
    [(0.42, 0.0), (0.5, 0.08), (0.56, 0.4), (0.46, 0.85), (0.2, 1.25), (0.15, 1.6), (0.2, 1.92)],
    [(0.172, 1.925), (0.125, 1.6), (0.172, 1.24), (0.42, 0.83), (0.52, 0.4), (0.46, 0.1), (0.02, 0.06)],
    frosted,
    (-1.95, 0.75, 0),
)

# The shaker: a brushed body with a polished collar and cap.
shaker_at = (0.98, 0.72, 0)
add("Shaker", lathe([(0, 0), (0.36, 0), (0.38, 0.03), (0.48, 1.15), (0.48, 1.2), (0, 1.2)], 72), steel, shaker_at, smooth=40)
add("Shaker collar", lathe([(0.47, 1.2), (0.49, 1.22), (0.49, 1.27), (0.47, 1.29), (0, 1.29)], 72), chrome, shaker_at, smooth=40)
cap = smooth_profile([(0.46, 1.29), (0.45, 1.42), (0.33, 1.62), (0.2, 1.7)], 8)
add("Shaker cap", lathe([*cap, (0.19, 1.72), (0.19, 1.9), (0.17, 1.93), (0, 1.93)], 72), chrome, shaker_at, smooth=40)

# A copper mug with a handle, and gold spheres.
mug_at = (2.05, 0.1, 0)
vessel(
    "Copper mug",
    [(0.34, 0.0), (0.38, 0.02), (0.4, 0.3), (0.39, 0.74), (0.4, 0.8)],
    [(0.385, 0.8), (0.37, 0.7), (0.375, 0.3), (0.34, 0.05), (0.02, 0.03)],
    copper,
    mug_at,
)
handle = lathe([(0.22 + 0.035 * cos(a), 0.035 * sin(a)) for a in (2 * pi * k / 16 for k in range(16))], 40, pi, -pi / 2, True)
add("Mug handle", handle, copper, (mug_at[0] + 0.36, mug_at[1], 0.42), (90, 0, 0), smooth=40)

# Balls of glass and gold, a lacquered box.
add("Glass ball", sphere(0.24, 64, 32), clear, (0.83, -0.92, 0.24), smooth=180)
add("Gold ball", sphere(0.17, 48, 24), gold, (1.42, -0.78, 0.17), smooth=180)
add("Chrome ball", sphere(0.27, 64, 32), chrome, (-0.32, 0.42, 0.27), smooth=180)
lacquer = principled(material("Red lacquer", "#7a0a10", 0.4), Coat_Weight=1.0, Coat_Roughness=0.02)
bevelled("Lacquered box", box(0.62, 0.42, 0.26), lacquer, 0.04, 4, location=(-1.75, -0.72, 0.13), rotation=(0, 0, 18))
amber = glass("Amber", "#e08a1e", 1.55)
add("Amber drop", sphere(0.12, 48, 24).scaled(1, 1, 0.8), amber, (-1.75, -0.72, 0.26 + 0.096), smooth=180)

light("Key", "SPOT", (-3.4, -3.0, 4.8), 1500, (0.1, 0.2, 0.4), "#ffe2bd", cone=55, blend=0.5, radius=0.25)
light("Back", "POINT", (2.6, 2.6, 3.2), 220, color="#bcd8ff", radius=0.3)
camera("Camera", (0.2, -7.2, 2.5), (0.12, 0.1, 0.8), fov=42)

export_gltf(out / "bar.glb")
