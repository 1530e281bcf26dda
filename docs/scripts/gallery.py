"""Renders the pictures of docs/tutorial/gallery.md by the command below each, and writes the page.

Also renders the pictures of other pages.

    python docs/scripts/gallery.py BLINN [NAME…]

NAME selects a picture; without one all are rendered. The page is written. Needs pillow.
"""

import os
import shlex
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from pictures import checkerboard

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs/images"
LARGEST = 300_000
PAPER = (250, 250, 248)


@dataclass
class Shot:
    """A picture: the command that makes its files, and the number of columns that show them."""

    name: str
    title: str
    text: str
    command: str
    files: list = None
    columns: int = 1
    # A script for the page that the command serves; its screenshot is the picture.
    page: str = None


SHOTS = [
    Shot(
        "still-life",
        "A still life",
        "The file's point light, spot and sun with soft shadows, and ambient occlusion: metals and dielectrics of roughness 0.12 to 0.95.",
        "blinn render models/still-life/still-life.glb --light-radius .12 --ao 64 -s 32 --adaptive .04 --size 960x640 -o still-life.png",
    ),
    Shot(
        "bar",
        "Metal and glass",
        "A wine glass and a tumbler with a wall and a drink in each, a frosted carafe; brushed steel, chrome, copper and gold; "
        "varnished wood. Reflected and refracted rays, and the studio environment where they escape.",
        "blinn render models/bar/bar.glb --hdri studio --light-radius .15 --ao 32 -s 64 --adaptive .02 --size 960x540 -o bar.png",
    ),
    Shot(
        "cornell",
        "A room with one lamp",
        "Shadows of a lamp as wide as its panel. The ambient term, with ambient occlusion, stands for indirect light.",
        "blinn render models/cornell/cornell.glb --light-radius .22 --ambient .09,.085,.08 --ao 64,1 -s 32 --adaptive .04 --size 640x640 "
        "-o cornell.png",
    ),
    Shot(
        "tower",
        "A toy for any page",
        "A transparent background (here over a checkerboard) with a shadow catcher.",
        "blinn render models/tower/tower.glb --background transparent --ground shadow --light-radius .18 --ao 64 -s 32 --adaptive .04 "
        "--size 720x540 -o tower.png",
    ),
    Shot(
        "plant",
        "Leaves and panes",
        "Cut-out leaves, two panes of coloured glass one behind the other, vertex colours, and the shadows of all.",
        "blinn render models/alpha/alpha.glb --light-radius .06 -s 32 --adaptive .04 --ao 32 --size 720x540 -o plant.png",
    ),
    Shot(
        "assembly",
        "A gear, cut open",
        "Bolts, balls and planet gears are instances of one mesh each. Three lights follow the camera.",
        "blinn render models/assembly/assembly.glb --hide 'Bench*' --orbit 38,24 --zoom 1.45 --lights three-point --ao 64 "
        "-s 32 --adaptive .04 --background '#e9e7e2' --light-radius .05 --size 840x600 -o assembly.png",
    ),
    Shot(
        "drawing",
        "A line drawing",
        "Sharp edges and outlines alone, in lines of a pixel. Surfaces hide what is behind them.",
        "blinn render models/assembly/assembly.glb --hide 'Bench*' --orbit 38,24 --zoom 1.45 --edges feature,silhouette --edges-only "
        "--background white -s 16 --size 840x600 -o drawing.png",
    ),
    Shot(
        "clay",
        "Without a light",
        "No lights: only the ambient term, with ambient occlusion.",
        "blinn render models/assembly/assembly.glb --hide 'Bench*' --orbit 38,24 --zoom 1.45 --lights none --ambient .9,.88,.84 "
        "--ao 64 --view standard --exposure 0 --background '#ffffff' -s 32 --adaptive .04 --size 840x600 -o clay.png",
    ),
    Shot(
        "plan",
        "From the side, without perspective",
        "An orthographic view along the axis, lit by a sun.",
        "blinn render models/assembly/assembly.glb --hide 'Bench*' --orbit 90,0 --projection orthographic --zoom 2.2 "
        "--lights none --sun -1,-.7,-.5,1.6 --ambient .22,.22,.24 --ao 64 -s 32 --adaptive .04 --background '#10131a' --size 720x720 -o plan.png",
    ),
    Shot(
        "tin",
        "Painted tin on planks",
        "Base colour, metallic-roughness and normal maps, filtered over the footprint of each sample.",
        "blinn render models/textured/textured.glb --light-radius .08 --ao 32 -s 32 --adaptive .04 --size 800x600 -o tin.png",
    ),
    Shot(
        "turntable",
        "Once around",
        "Eight frames of a turntable; camera and lights stand still.",
        "blinn turntable models/textured/textured.glb --only-objects 'Tin*' --count 8 --elevation 20 --ground shadow "
        "--background '#dfe3e6' --lights none --sun .8,-1.4,-1,1.1 --ambient .3,.3,.3 --light-radius .08 -s 32 --adaptive .04 --size 240x260 "
        "-o turn_####.png",
        [f"turn_{i:04}.png" for i in range(1, 9)],
        4,
    ),
    Shot(
        "walk",
        "A walk cycle",
        "A skin of seventeen joints and a morph target, at six frames.",
        "blinn render models/figure/figure.glb --frames 4-44:8 --lights three-point --ground shadow --background '#efe9df' "
        "--light-radius .05 --ao 32 -s 32 --adaptive .04 --size 160x320 -o walk_####.png",
        [f"walk_{i:04}.png" for i in range(4, 45, 8)],
        6,
    ),
    Shot(
        "reconstruction",
        "A reconstruction",
        "Points as spheres as large as closes the gaps of their cloud, lines of two pixels. No camera has seen the cloth behind the ball.",
        "blinn render models/reconstruction/reconstruction.glb --line-width 2px --background '#f4f2ee' -s 16 --size 840x630 -o reconstruction.png",
    ),
    Shot(
        "layers",
        "Layers",
        "AOVs for compositing and for learning: depth, normals, albedo, position, objects, Cryptomatte.",
        "blinn render models/still-life/still-life.glb --aov depth,normal,albedo,position,object-id,cryptomatte "
        "--size 360x240 -s 16 -o layers.png",
        [f"layers.{n}.png" for n in ("depth", "normal", "albedo", "position", "object-id", "cryptomatte-object")],
        3,
    ),
    Shot(
        "lecture",
        "The lecture's scene",
        "With the lecture's own camera block, two lamps and an ambient term.",
        "blinn render models/lecture/lecture.obj --camera-xml models/lecture/view-1.xml --lights none --point-light 6,8,4.5,90 "
        "--point-light 7,3,-6,20,.6,.8,1 --ambient .08,.08,.08 --light-radius .5 --ao 32 -s 32 --adaptive .04 --size 960x540 -o lecture.png",
    ),
    Shot(
        "stages",
        "Stages of the lecture",
        "Colour; Lambert; Lambert with shadows; the full sum.",
        "for stage in color diffuse shadow phong; do blinn render models/lecture/lecture.obj --integrator $stage "
        "--camera-xml models/lecture/view-2.xml --lights none --point-light 6,8,4.5,90 --point-light 7,3,-6,20 "
        "--ambient .05,.05,.05 -s 16 --size 400x225 -o stage-$stage.png; done",
        [f"stage-{s}.png" for s in ("color", "diffuse", "shadow", "phong")],
        2,
    ),
    Shot(
        "night",
        "Two lamps at night",
        "The figure between a warm and a cold lamp.",
        "blinn render models/figure/figure.glb --frame 12 --lights none --point-light -1.6,2.2,1.2,5.5,1,.55,.22 "
        "--point-light 1.8,1.4,-1,7,.25,.45,1 --ambient .012,.014,.02 --ground plane --light-radius .12 --ks .25,.25,.25 "
        "--shininess 40 --background '#07080c' --orbit 20,8 --zoom 2.6 -s 32 --adaptive .04 --size 600x720 -o night.png",
    ),
    Shot(
        "gloss",
        "From chalk to billiard ball",
        "The exponent p, from 4 to 1024, on one sphere.",
        "for p in 4 16 64 256 1024; do blinn render models/tests/closed_sphere.obj --smooth 180 --view-point 0,0,6 --look-at 0,0,0 "
        "--yfov 21 --lights none --point-light 3,4,5,45 --point-light -5,1,2,6,.5,.7,1 --kd .5,.06,.05 --ks .7,.7,.7 "
        "--shininess $p --ambient .04,.04,.05 --background '#22252b' -s 32 --adaptive .04 --size 190x190 -o gloss-$p.png; done",
        [f"gloss-{p}.png" for p in (4, 16, 64, 256, 1024)],
        5,
    ),
    Shot(
        "view",
        "In the browser",
        "The page of `blinn view`: the camera is found by dragging, and *Copy command* gives the command of the picture.",
        "blinn view models/still-life/still-life.glb -s 16",
        page="""[m.state.select(m.scene.objects.findIndex(o => o.name === 'Vase')), m.state.change({hdri: 'studio', camera: {
            ...c.defaultOrbit(c.sphereOf(m.scene.bounds), 1), target: [-1, 1.5, 0], azimuth: 20, elevation: 14, distance: 8}})].length""",
    ),
    Shot(
        "sheet",
        "A sheet with dimensions",
        "Top, isometric, front and right view at one scale.",
        "blinn sheet models/assembly/assembly.glb --hide 'Bench*' --ao 64 -s 32 --lights three-point --size 960x720 -o sheet.png",
    ),
    Shot(
        "diff",
        "What has changed",
        "Views before, after, and their difference. The cube is higher, and the small sphere is red.",
        "cp models/lecture/lecture.mtl .; sed 's/usemtl Gold/usemtl Red/; 12,20s/ 0.5 / 0.9 /' models/lecture/lecture.obj > changed.obj; "
        "blinn diff models/lecture/lecture.obj changed.obj -o diff.png --size 300x225 -s 16 || test $? = 1",
        ["diff.png"],
    ),
    Shot(
        "thumbnails",
        "Thumbnails",
        "`--max-size`, with the aspect ratio of each file's camera; the Debian package shows them in file managers.",
        "blinn render models/*/*.glb --max-size 180 -s 16 -o thumbnails/",
        [f"thumbnails/{name}.png" for name in ("alpha", "assembly", "cornell", "figure", "lecture", "reconstruction", "still-life", "textured", "tower")],
        3,
    ),
]

SOFT = "--light-radius .15 --ao 32 -s 16 --background '#d9d4c8'"
TOWER = "blinn render models/tower/tower.glb --size 640x360"
TURN = [f"turn_{i:04}.png" for i in range(1, 25, 4)]

# Pictures of other pages, which show the commands.
OTHERS = [
    Shot(
        "edges",
        "",
        "",
        "blinn render models/assembly/assembly.glb --edges feature --size 420x320 -s 16 -o edges.png; "
        "blinn render models/assembly/assembly.glb --only-objects 'Base bolt seat 1' --orbit 30,15 --edges feature,silhouette "
        "--edges-only --hidden-edges dashed --background white --size 420x320 -s 16 -o bolt.png",
        ["edges.png", "bolt.png"],
        2,
    ),
    Shot("tutorial-first", "", "", f"{TOWER} -o first.png"),
    Shot("tutorial-soft", "", "", f"{TOWER} {SOFT} -o soft.png"),
    Shot("tutorial-ground", "", "", f"{TOWER} {SOFT} --ground shadow -o ground.png"),
    Shot(
        "tutorial-turn",
        "",
        "",
        "blinn turntable models/tower/tower.glb --count 24 --only 1-24:4 --size 240x180 --ground shadow --light-radius .15 "
        "-s 16 --background '#d9d4c8' -o turn_####.png",
        TURN,
        3,
    ),
    Shot(
        "product",
        "",
        "",
        "blinn render models/textured/textured.glb --only-objects 'Tin*' --orbit 25,20 --size 480x480 --background transparent "
        "--ground shadow --lights three-point --light-radius .05 -s 16 --view pbr-neutral -o tin.png",
    ),
]


def over_checkerboard(image):
    if image.mode != "RGBA":
        return image.convert("RGB")
    under = checkerboard(image.size)
    under.paste(image, mask=image.getchannel("A"))
    return under


def sheet(images, columns, gap=6):
    """Places pictures in a grid, each in the middle of its cell."""
    if len(images) == 1:
        return images[0]
    width, height = (max(sides) for sides in zip(*(image.size for image in images)))
    rows = -(-len(images) // columns)
    paper = Image.new("RGB", (columns * (width + gap) - gap, rows * (height + gap) - gap), PAPER)
    for i, image in enumerate(images):
        left, top = (width - image.width) // 2, (height - image.height) // 2
        paper.paste(image, (i % columns * (width + gap) + left, i // columns * (height + gap) + top))
    return paper


def picture_page(folder, shot):
    """Takes the screenshot of a page in Chromium."""
    sys.path.insert(0, str(ROOT / ".ci"))
    import viewer

    os.chdir(folder)
    viewer.picture_page(shlex.split(shot.command)[2:], "page.png", shot.page)
    os.chdir(ROOT)


def make(blinn, shot):
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (folder / "models").symlink_to(ROOT / "models")
        if shot.page:
            files = ["page.png"]
            picture_page(folder, shot)
        else:
            path = f"{blinn.parent}{os.pathsep}{os.environ['PATH']}"
            command = ["bash", "-euc", shot.command]
            subprocess.run(command, check=True, cwd=folder, env={**os.environ, "PATH": path}, stderr=subprocess.DEVNULL)
            files = shot.files or [shlex.split(shot.command)[-1]]
        picture = sheet([over_checkerboard(Image.open(folder / f)) for f in files], shot.columns)
    out = IMAGES / (f"gallery-{shot.name}.jpg" if shot.title else f"{shot.name}.jpg")
    for quality in (92, 88, 84, 78):
        picture.save(out, quality=quality, optimize=True, progressive=True)
        if out.stat().st_size <= LARGEST:
            break
    print(f"{out.relative_to(ROOT)}: {picture.size[0]}x{picture.size[1]}, {out.stat().st_size} bytes", flush=True)


def wrapped(command, width=100):
    """Breaks a command into several shell lines."""
    lines, line = [], ""
    for word in command.split(" "):
        if line and len(line) + len(word) > width:
            lines.append(line)
            line = "   "
        line = f"{line} {word}" if line else word
    return " \\\n".join(lines + [line])


def page():
    lines = ["# Gallery", "", "Made by `docs/scripts/gallery.py`, each picture by the command below it.", ""]
    for shot in SHOTS:
        lines += [f"## {shot.title}", "", f"![{shot.title}](../images/gallery-{shot.name}.jpg)", "", shot.text, ""]
        lines += ["```sh gallery", wrapped(shot.command), "```", ""]
    return "\n".join(lines[:-1]) + "\n"


def main():
    blinn, names = Path(sys.argv[1]).resolve(), sys.argv[2:]
    for shot in SHOTS + OTHERS:
        if not names or shot.name in names:
            make(blinn, shot)
    (ROOT / "docs/tutorial/gallery.md").write_text(page())


if __name__ == "__main__":
    main()
