"""Renders the pictures of docs/reference/options.md and docs/reference/lecture-charts.md, and writes both pages.

Each option is one sheet of tiles.

    python docs/scripts/pictures.py BLINN [NAME…]

NAME selects a sheet; without one all are rendered. Both pages are written. Needs pillow, and numpy for the sky.
"""

import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs/images"
MODELS = ROOT / "models"
STILL = "still-life/still-life.glb"
LECTURE = "lecture/lecture.glb"
BALL = "tests/closed_sphere.obj"
BALL_VIEW = "--smooth 180 --view-point 0,0,6 --look-at 0,0,0 --yfov 22 --background #30343a --lights none"
LAMP = "--point-light 3,4,5,45"
GAP, LABEL = 6, 22
PAPER, INK = (250, 250, 248), (30, 30, 30)


@dataclass
class Sheet:
    """A picture of labelled tiles. `tiles` are the flags of each, added to the common `flags`."""

    name: str
    title: str
    text: str
    scene: str
    tiles: list
    flags: str = ""
    size: tuple = (300, 200)
    columns: int = 3
    page: str = "options"
    labels: list = field(default_factory=list)


def grey(v):
    """Returns a grey as an R,G,B triple."""
    return ",".join([f"{v:g}".removeprefix("0") or "0"] * 3)


def balls(name, title, text, tiles, columns, flags="", scene=BALL):
    return Sheet(name, title, text, scene, tiles, f"{BALL_VIEW} {LAMP} {flags}", (150, 150), columns, "lecture")


LECTURE_SHEETS = [
    balls(
        "lecture-kd",
        "The diffuse coefficient",
        "L = k_d (I/r²) max(0, n·l). The light is the same in all tiles; the surface reflects more of it from left to right.",
        [f"--kd {grey(k)}" for k in (0.1, 0.25, 0.4, 0.6, 0.8, 1)],
        6,
        "--ks 0,0,0 --ambient 0,0,0",
    ),
    balls(
        "lecture-p",
        "The exponent p",
        "max(0, n·h)^p: a larger p narrows the highlight and keeps the value at its centre.",
        [f"--shininess {p}" for p in (2, 5, 10, 50, 200, 1000)],
        6,
        "--kd .1,.12,.3 --ks .7,.7,.7 --ambient 0,0,0",
    ),
    balls(
        "lecture-ks-p",
        "k_s and p together",
        "k_s increases from top to bottom, p from left to right. With small values the ball looks like chalk, with "
        "large ones like a billiard ball.",
        [f"--ks {grey(k)} --shininess {p}" for k in (0.1, 0.3, 0.6, 1) for p in (5, 20, 100, 500)],
        4,
        "--kd .45,.1,.1 --ambient .03,.03,.03",
    ),
    balls(
        "lecture-ambient",
        "Ambient light",
        "L = k_a I_a + …: without it, points that no light reaches are black. With too much of it, shading looks flat.",
        [f"--ambient {grey(a)}" for a in (0, 0.05, 0.15, 0.4)],
        4,
        "--ks .3,.3,.3 --shininess 60",
        "{green}",
    ),
    Sheet(
        "lecture-stages",
        "The lecture, step by step",
        "The integrators are stages of the sum: the surface's colour; Lambert; Lambert with shadows; the full sum.",
        "lecture/lecture.obj",
        ["--integrator color", "--integrator diffuse", "--integrator shadow", "--integrator phong"],
        "--camera-xml models/lecture/view-1.xml --point-light 6,8,4.5,90 --point-light 7,3,-6,20 --ambient .05,.05,.05 "
        "--lights none",
        (320, 180),
        2,
        "lecture",
    ),
]

LAYERS = (
    "depth", "normal", "vertex-normal", "geometric-normal", "position", "albedo",
    "uv", "mask", "object-id", "material-id", "cryptomatte:object", "cryptomatte:material",
)

OPTION_SHEETS = [
    Sheet(
        "lights",
        "Light sources",
        "`--lights` takes a list. By default the file's own lights are used, or three lights fixed to the camera if it "
        "has none. `--point-light` and `--sun` add lights.",
        LECTURE,
        [
            "--lights file",
            "--lights headlight",
            "--lights three-point",
            "--lights file,headlight",
            "--lights none --point-light 3,2,4,15,1,.8,.5",
            "--lights none --sun -1,-.5,.4,1",
        ],
    ),
    Sheet(
        "light-units",
        "Light units",
        "Blender writes the same lamp in one of three units, and the file does not record which. By default all three are "
        "exposed alike; with the right `--light-units` and `--exposure 0` radiance equals Blender's.",
        "tests/light-units/point_SPEC.glb",
        [
            "",
            "--light-units standard --exposure 0",
            "@tests/light-units/point_COMPAT.glb",
            "@tests/light-units/point_COMPAT.glb --light-units unitless --exposure 0",
            "@tests/light-units/point_RAW.glb",
            "@tests/light-units/point_RAW.glb --light-units raw --exposure 0",
        ],
        columns=2,
        size=(240, 160),
        labels=[
            "Standard: by default", "Standard: --light-units standard --exposure 0",
            "Unitless: by default", "Unitless: --light-units unitless --exposure 0",
            "Raw: by default", "Raw: --light-units raw --exposure 0",
        ],
    ),
    Sheet(
        "exposure",
        "Exposure",
        "Stops, or `auto`: mid-grey for what the first camera sees, with at most a hundredth of it clipped.",
        STILL,
        ["--exposure -2", "--exposure -1", "--exposure 0", "--exposure 1", "--exposure 2", "--exposure auto"],
    ),
    Sheet(
        "view",
        "View transforms",
        "`agx` is what Blender shows, and the default for its files; `standard` clips; `pbr-neutral` keeps base colours; "
        "`raw` applies nothing. One stop brighter than usual, to show highlights.",
        STILL,
        ["--view agx", "--view standard", "--view pbr-neutral", "--view raw"],
        "--exposure 1",
        columns=2,
    ),
    Sheet(
        "samples",
        "Samples",
        "A part of a picture, magnified four times. One sample is at the pixel's centre; four are the default.",
        STILL,
        ["-s 1", "-s 4", "-s 16", "-s 64"],
        "--size 960x640 --crop 700,228,75,50",
        columns=4,
    ),
    Sheet(
        "filter",
        "Reconstruction filters",
        "The same part with 64 samples. Wider filters are smoother and softer.",
        STILL,
        [f"--filter {f}" for f in ("box", "tent", "gaussian", "blackman-harris")],
        "--size 960x640 --crop 700,228,75,50 -s 64",
        columns=4,
    ),
    Sheet(
        "transparency",
        "Transparency",
        "Cut-out leaves and panes of glass, in any order and depth, for the eye (up to 4,096 surfaces) and for shadows. "
        "With `--background transparent`, alpha is 0 where nothing is hit (here over a checkerboard).",
        "alpha/alpha.glb",
        ["--background .05,.05,.05", "--background #8fb3d9", "--background transparent"],
        "--hide Wall --hide Floor",
    ),
    Sheet(
        "ao",
        "Ambient occlusion",
        "Weights the ambient term by the visible share of the surroundings; here no other light is on. Few rays suffice. "
        "An MTL with `Ka 0 0 0` has no ambient term: without that line k_a is the diffuse colour, and with `--hdri` it always is.",
        "assembly/assembly.glb",
        ["", "--ao 4", "--ao 16", "--ao 64", "--ao 64,.02", "--ao 64,inf"],
        "--lights none --ambient .8,.8,.8 --exposure 0 --view standard",
    ),
    Sheet(
        "hdri",
        "Environment maps",
        "`--hdri` lights the scene with an environment map: here a blue sky with a low sun. `studio` and `sky` need no file.",
        STILL,
        [
            "--lights file",
            "--hdri {sky} --lights none",
            "--hdri {sky} --lights none --ao 32",
            "--hdri studio --lights none --ao 32",
            "--hdri sky --lights none --background hdri",
            "--hdri sky --lights none --background hdri --background-blur .4 --hdri-rotate 120",
        ],
    ),
    Sheet(
        "light-radius",
        "Soft shadows",
        "Lights are discs of this radius. The default is 0, a point.",
        LECTURE,
        ["--light-radius 0", "--light-radius .2", "--light-radius .8"],
        "-s 32",
    ),
    Sheet(
        "ground",
        "A ground",
        "For scenes without a floor: a grey plane, or a shadow catcher, also on a transparent background.",
        "textured/textured.glb",
        ["--background #d8d8d4", "--ground plane --background #d8d8d4", "--ground shadow --background #d8d8d4", "--ground shadow --background transparent"],
        "--only-objects Tin* --orbit 30,30 --lights none --sun 1,-1.6,.2,1 --light-radius .05 -s 16 --ambient .15,.15,.15",
        columns=2,
    ),
    Sheet(
        "aov",
        "Layers",
        "Previews of `--aov`, as written beside a PNG. An EXR holds the values themselves. (The mask is that of the scene "
        "under Transparency: here it would be white.)",
        STILL,
        [
            "@alpha/alpha.glb --hide Wall --hide Floor --aov mask" if a == "mask" else f"--aov {a}" for a in LAYERS
        ],
        columns=4,
        size=(240, 160),
        labels=[a.replace(":", ": ") for a in LAYERS],
    ),
    Sheet(
        "integrator",
        "Integrators",
        "Stages of the lecture: the surface's colour, Lambert, Lambert with shadows, the full sum.",
        STILL,
        ["--integrator color", "--integrator diffuse", "--integrator shadow", "--integrator phong"],
        columns=2,
    ),
    Sheet(
        "orbit",
        "Camera positions",
        "`--orbit AZIMUTH,ELEVATION` around the centre of the scene, whatever camera it has; `--zoom`; "
        "`--projection orthographic`.",
        "assembly/assembly.glb",
        [
            "--orbit 0,0", "--orbit 45,20", "--orbit 90,20", "--orbit 0,89",
            "--orbit 45,20 --zoom .6", "--orbit 45,20 --zoom 1.8", "--orbit 45,20 --projection orthographic",
            "--orbit 45,20 --yfov 70",
        ],
        "--lights three-point --hide Bench*",
        (220, 150),
        4,
    ),
    Sheet(
        "override",
        "Override the coefficients",
        "`--kd`, `--ks` and `--shininess` replace those of every material.",
        LECTURE,
        ["", "--kd .7,.7,.7 --ks 0,0,0", "--ks .6,.6,.6 --shininess 100"],
    ),
    Sheet(
        "smooth",
        "Normals by angle",
        "`--smooth` recomputes normals; edges sharper than the angle stay sharp. Facets of a coarse ball do not show in its own "
        "shadow, whose border follows the smooth surface.",
        "{coarse}",
        ["--smooth off", "--smooth 20", "--smooth 180"],
        "--lights none --sun -1,-.6,-.5,1 --ambient .05,.05,.05 --orbit 0,15 --background #8a94a0",
        (240, 200),
    ),
    Sheet(
        "select",
        "Select objects",
        "`--hide` and `--only-objects` take patterns of names; hidden objects cast no shadow.",
        "assembly/assembly.glb",
        ["", "--hide *ousing*", "--only-objects *lanet*"],
    ),
    Sheet(
        "time",
        "Times of an animation",
        "`--time` in seconds, or `--frame` with `--fps`.",
        "figure/figure.glb",
        [f"--time {t}" for t in (0.25, 0.5, 0.75, 1.0, 1.25, 1.5)],
        columns=6,
        size=(150, 200),
    ),
]


def font(size):
    return ImageFont.load_default(size)


def checkerboard(size):
    """Returns a checkerboard as background of transparent pictures."""
    image = Image.new("RGB", size, (205, 205, 205))
    draw = ImageDraw.Draw(image)
    for y in range(0, size[1], 10):
        for x in range(0, size[0], 10):
            if (x + y) // 10 % 2:
                draw.rectangle((x, y, x + 9, y + 9), (235, 235, 235))
    return image


def sky(path):
    """Writes a blue sky over brown ground with a low sun, in Radiance format."""
    v, u = np.mgrid[0:64, 0:128].astype(float)
    up, around = np.cos(np.pi * (v + 0.5) / 64), 2 * np.pi * (u + 0.5) / 128
    blue = np.where((up > 0)[..., None], [0.25, 0.4, 0.75], [0.12, 0.09, 0.06])
    light = blue * (0.6 + 0.4 * np.abs(up))[..., None]
    near = np.exp(-(((around - 4.2) / 0.25) ** 2 + ((up - 0.35) / 0.2) ** 2))
    light = light + near[..., None] * np.array([14, 9, 5])
    exponent = np.ceil(np.log2(light.max(-1)))
    mantissa = light / 2 ** exponent[..., None] * 255
    rgbe = np.concatenate([mantissa, exponent[..., None] + 128], -1).astype(np.uint8)
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 64 +X 128\n" + rgbe.tobytes())


def coarse(path):
    """Writes a ball of 96 quadrilaterals."""
    sys.path.insert(0, str(MODELS / "scripts"))
    from shapes import sphere

    shape = sphere(1, 12, 8).y_up()
    lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in shape.verts]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in shape.faces]
    path.write_text("\n".join(lines) + "\n")


def green(path):
    """Writes the models' ball with a green material: its k_a is its k_d."""
    path.with_suffix(".mtl").write_text("newmtl green\nKd .3 .5 .25\n")
    path.write_text("mtllib green.mtl\nusemtl green\n" + (MODELS / BALL).read_text())


def render(blinn, sheet, tile, folder):
    paths = {"sky": folder / "sky.hdr", "coarse": folder / "coarse.obj", "green": folder / "green.obj"}
    words = tile.format(**paths).split()
    scene = words.pop(0)[1:] if tile.startswith("@") else sheet.scene.format(**paths)
    flags = sheet.flags.split()
    layer, which = None, ""
    if "--aov" in words:
        name = words.index("--aov") + 1
        layer, _, which = words[name].partition(":")
        words[name] = layer
    width, height = sheet.size
    out = folder / "tile.png"
    if "--size" not in flags:
        words += ["--size", f"{width}x{height}"]
    if "-s" not in words + flags:
        words += ["-s", "16"]
    scene = scene if Path(scene).is_absolute() else MODELS / scene
    subprocess.run([blinn, "render", scene, "-o", out, "-q", *flags, *words], check=True, cwd=ROOT)
    if layer:
        out = folder / f"tile.{layer}{'-' + which if which else ''}.png"
    image = Image.open(out)
    if image.size != sheet.size:
        image = image.resize(sheet.size, Image.NEAREST)
    if image.mode == "RGBA":
        under = checkerboard(sheet.size)
        under.paste(image, mask=image.getchannel("A"))
        image = under
    return image.convert("RGB")


def fit_font(text, width):
    """Returns the largest font in which the text fits the width."""
    size = 13
    while size > 7 and font(size).getlength(text) > width:
        size -= 1
    return font(size)


def make(blinn, sheet, folder):
    width, height = sheet.size
    columns = min(sheet.columns, len(sheet.tiles))
    rows = -(-len(sheet.tiles) // columns)
    paper = Image.new(
        "RGB", (columns * (width + GAP) + GAP, rows * (height + LABEL + GAP) + GAP), PAPER
    )
    draw = ImageDraw.Draw(paper)
    for i, tile in enumerate(sheet.tiles):
        x = GAP + i % columns * (width + GAP)
        y = GAP + i // columns * (height + LABEL + GAP)
        paper.paste(render(blinn, sheet, tile, folder), (x, y))
        text = sheet.labels[i] if sheet.labels else label(tile)
        draw.text((x + 2, y + height + LABEL / 2), text, INK, fit_font(text, width - 4), anchor="lm")
    out = IMAGES / f"{sheet.name}.jpg"
    paper.save(out, quality=84, optimize=True, progressive=True)
    print(f"{out.relative_to(ROOT)}: {out.stat().st_size} bytes")


def label(tile):
    """Returns a tile's flags as a reader would type them."""
    return tile.replace("{sky}", "sky.hdr") or "(default)"


def page(title, opening, sheets):
    """Returns the Markdown page of all sheets."""
    lines = [f"# {title}", "", *opening, ""]
    for sheet in sheets:
        lines += [f"## {sheet.title}", "", sheet.text, "", f"![{sheet.title}](../images/{sheet.name}.jpg)", ""]
        generated = {"{coarse}": "a ball of 96 faces", "{green}": "a green ball"}
        scene = generated.get(sheet.scene, f"`models/{sheet.scene}`")
        shared = f"; common flags: `{' '.join(sheet.flags.split())}`" if sheet.flags else ""
        lines += [f"Scene: {scene}{shared}.", ""]
    return "\n".join(lines[:-1]) + "\n"


def main():
    blinn, names = str(Path(sys.argv[1]).resolve()), sys.argv[2:]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        sky(folder / "sky.hdr")
        coarse(folder / "coarse.obj")
        green(folder / "green.obj")
        for sheet in LECTURE_SHEETS + OPTION_SHEETS:
            if not names or sheet.name in names:
                make(blinn, sheet, folder)
    write_pages()


def write_pages():
    made = "Made by `docs/scripts/pictures.py`, which renders each tile with the flags below it."
    (ROOT / "docs/reference/lecture-charts.md").write_text(page("The lecture's charts", [made], LECTURE_SHEETS))
    (ROOT / "docs/reference/options.md").write_text(
        page("Options in pictures", [made + " `blinn render --help` lists all options."], OPTION_SHEETS)
    )


if __name__ == "__main__":
    main()
