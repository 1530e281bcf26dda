"""A painted tea tin on planks: base colour, metallic-roughness and normal textures made here with numpy.

Written as textured.glb, as textured.gltf with its .bin and the PNGs beside it,
and as textured.obj with map_Kd. One texture's name has a space.
"""

import numpy as np

from blend import add, base_texture, camera, export_gltf, export_obj, image, light, material, new_scene, texture
from files import folder, png, write
from shapes import box, join, lathe

out = folder("textured")
new_scene(960, 720)
random = np.random.default_rng(11)


def smooth_noise(h, w, cells):
    """Returns tileable values in 0…1."""
    lattice = random.random((cells, cells))
    y, x = np.mgrid[0:h, 0:w].astype(float)
    y, x = y / h * cells, x / w * cells
    i, j = y.astype(int), x.astype(int)
    fy, fx = (t * t * (3 - 2 * t) for t in (y - i, x - j))

    def at(a, b):
        return lattice[a % cells, b % cells]

    return (at(i, j) * (1 - fx) + at(i, j + 1) * fx) * (1 - fy) + (at(i + 1, j) * (1 - fx) + at(i + 1, j + 1) * fx) * fy


def save(name, rgb):
    write(out / name, png((rgb.clip(0, 1) * 255 + 0.5).astype(np.uint8)))
    return out / name


def normals(height, strength):
    """A tangent-space normal map (green up) of a height field that wraps horizontally."""
    dx = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) * strength
    dy = -np.gradient(height, axis=0) * 2 * strength  # rows run downward
    n = np.stack([-dx, -dy, np.ones_like(height)], -1)
    return n / np.linalg.norm(n, axis=-1, keepdims=True) * 0.5 + 0.5


# The tin's side, unrolled: u once around, v from the base to the lid.
H, W = 512, 1024
row, col = np.mgrid[0:H, 0:W]
u, v = (col + 0.5) / W, 1 - (row + 0.5) / H
PAINT, CREAM, GOLD, METAL = (
    np.array(c) / 255 for c in ((22, 74, 92), (240, 226, 190), (216, 164, 60), (190, 186, 178))
)

colour = np.ones((H, W, 3)) * PAINT
height = np.zeros((H, W))
gold = np.zeros((H, W), bool)
for edge in (0.1, 0.9):
    gold |= abs(v - edge) < 0.018
    gold |= (abs(v - edge) < 0.05) & (abs((u * 48) % 1 - 0.5) < 0.5 - abs(v - edge) / 0.05 * 0.5)
# Four round labels, each with the same five letters of 5 × 5 dots.
GLYPHS = {
    "B": "####.#...#####.#...#####.",
    "L": "#....#....#....#....#####",
    "I": "#####..#....#....#..#####",
    "N": "#...###..##.#.##..###...#",
}
label = np.zeros((H, W), bool)
text = np.zeros((H, W), bool)
for k in range(4):
    du = ((u - (k + 0.5) / 4 + 0.5) % 1 - 0.5) * 2 * np.pi * 0.62  # metres round the side, as v below
    dv = (v - 0.5) * 1.5
    r = np.hypot(du, dv)
    label |= r < 0.40
    gold |= (abs(r - 0.42) < 0.02) | (abs(r - 0.36) < 0.006)
    for n, letter in enumerate("BLINN"):
        gx = np.floor((du + 0.29) / 0.02 - n * 6).astype(int)
        gy = np.floor((0.07 - dv) / 0.032).astype(int)
        inside = (gx >= 0) & (gx < 5) & (gy >= 0) & (gy < 5)
        bits = np.array([c == "#" for c in GLYPHS[letter]]).reshape(5, 5)
        text |= inside & bits[gy.clip(0, 4), gx.clip(0, 4)]
    # A lamp above the word and its shadow below it: a disc and a half disc.
    gold |= (np.hypot(du, dv - 0.2) < 0.06) | ((np.hypot(du, dv + 0.24) < 0.1) & (dv > -0.24))
colour[label] = CREAM
colour[gold] = GOLD
colour[text & label] = PAINT
noise = 0.6 * smooth_noise(H, W, 24) + 0.4 * smooth_noise(H, W, 90)
worn = (noise > 0.80) | ((noise > 0.62) & ((v < 0.05) | (v > 0.95)))
colour[worn] = METAL
colour *= (0.9 + 0.1 * smooth_noise(H, W, 12))[..., None]

ribs = np.maximum(0, np.cos((v - 0.5) * 2 * np.pi * 11)) ** 2 * ((abs(v - 0.5) > 0.3) & (abs(v - 0.5) < 0.36))
height = 2.5 * gold + 1.5 * (text & label) - 1.2 * worn + 3 * ribs
for axis in (0, 1):  # soften the steps
    for _ in range(2):
        height = (np.roll(height, 1, axis) + 2 * height + np.roll(height, -1, axis)) / 4
metallic = np.where(worn | gold, 1.0, 0.0)
roughness = np.where(worn, 0.5, np.where(gold, 0.35, np.where(label, 0.5, 0.25)))

side = material("Tin side")
base_texture(side, image(save("tin base.png", colour)))
node, principled, links = texture(
    side, image(save("tin_metal_rough.png", np.stack([np.ones((H, W)), roughness, metallic], -1)), data=True)
)
split = side.node_tree.nodes.new("ShaderNodeSeparateColor")
links.new(node.outputs["Color"], split.inputs["Color"])
links.new(split.outputs["Green"], principled.inputs["Roughness"])
links.new(split.outputs["Blue"], principled.inputs["Metallic"])
node, principled, links = texture(side, image(save("tin_normal.png", normals(height, 0.35)), data=True))
bump = side.node_tree.nodes.new("ShaderNodeNormalMap")
links.new(node.outputs["Color"], bump.inputs["Color"])
links.new(bump.outputs["Normal"], principled.inputs["Normal"])

add("Tin side", lathe([(0.62, 0.04), (0.62, 1.54)], 64), side, rotation=(0, 0, -33), smooth=40)
metal = material("Tin metal", (0.8, 0.77, 0.7), 0.42, 1.0)
foot = lathe([(0, 0), (0.63, 0), (0.645, 0.02), (0.63, 0.045), (0.62, 0.045)], 64)
lid = lathe(
    [
        (0.62, 1.53),
        (0.645, 1.53),
        (0.65, 1.55),
        (0.65, 1.70),
        (0.63, 1.73),
        (0.52, 1.745),
        (0.5, 1.72),
        (0.12, 1.72),
        (0.08, 1.74),
        (0.06, 1.80),
        (0.12, 1.86),
        (0.12, 1.90),
        (0.07, 1.94),
        (0, 1.945),
    ],
    64,
)
add("Tin foot and lid", join(foot, lid), metal, smooth=30)

# The table: three boards, one texture.
S = 256
row, col = np.mgrid[0:S, 0:S]
grain = 0.5 + 0.5 * np.sin(2 * np.pi * (row / S * 9 + 1.2 * smooth_noise(S, S, 4) + 0.25 * smooth_noise(S, S, 32)))
wood = np.array((150, 104, 62)) / 255 * (0.72 + 0.28 * grain + 0.1 * smooth_noise(S, S, 40) - 0.05)[..., None]
planks = material("Planks", roughness=0.6)
base_texture(planks, image(save("planks.png", wood)))
for k in range(4):
    board = box(6, 1.0, 0.12)
    board.uvs = [[(2 * a + 0.37 * k, 0.5 * b + 0.25 * k) for a, b in face] for face in board.uvs]
    add(f"Board {k + 1}", board, planks, (0, 1.03 * (k - 1.5), -0.06))

light("Lamp", "SPOT", (-2.4, -2.8, 3.6), 1000, (0, 0, 0.7), "#ffe3c0", cone=60, blend=0.5, radius=0.05)
light("Fill", "POINT", (2.8, -2.2, 1.8), 160, color="#d5e4ff", radius=0.1)
camera("Camera", (0.9, -4.1, 1.9), (0, 0, 0.86), fov=40)

export_gltf(out / "textured.glb")
export_gltf(out / "textured.gltf", export_keep_originals=True)
export_obj(out / "textured.obj")
