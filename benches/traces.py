#!/usr/bin/env python3
"""Traces three jobs and draws when each thread worked on which stage: docs/images/trace-*.svg.

    traces.py BLINN SCAN.obj [--rounds 5] [--threads N] [--keep FOLDER]

The jobs are thumbnails of the models (each twice), an OBJ file of 1.1 million triangles, and an EXR with layers. Of some rounds
the shortest is drawn: the one that other programs disturbed least. With --keep, the traces stay in a folder, and those
that are there already are drawn instead of new ones.
"""
import argparse
import html
import json
import os
import subprocess
import sys
import tempfile

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), ".."))
IMAGES = os.path.join(ROOT, "docs", "images")

# Colours of stages (Okabe and Ito), in the order of the legend.
COLORS = {
    "load": "#0072b2", "pose": "#cc79a7", "build": "#e69f00", "meter": "#56b4e9", "render": "#009e73", "aovs": "#f0e442",
    "save": "#d55e00",
}
OTHER = "#8c8c8c"
STYLE = """
.page { fill: #ffffff } .ink { fill: #24292f } .axis { stroke: #8c959f } .even { fill: #57606a } .odd { fill: #afb8c1 }
.idle { fill: #eaeef2 } .edge { stroke: #ffffff }
@media (prefers-color-scheme: dark) {
  .page { fill: #0d1117 } .ink { fill: #e6edf3 } .axis { stroke: #6e7681 } .even { fill: #b1bac4 } .odd { fill: #6e7681 }
  .idle { fill: #21262d } .edge { stroke: #0d1117 }
}"""

WIDTH, LEFT, RIGHT, TOP, ROW, GAP = 800, 74, 16, 66, 30, 16


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("blinn", help="the program")
    parser.add_argument("scan", help="an OBJ file of 1.1 million triangles: just scene scan 1.1m SCAN.obj")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--keep", metavar="FOLDER")
    return parser.parse_args()


def jobs(args, folder):
    """Title and arguments of each job, by its name."""
    models = os.path.join(ROOT, "models")
    scenes = [os.path.join(models, name, name + ".glb") for name in sorted(os.listdir(models))]
    scenes = [scene for scene in scenes if os.path.exists(scene)]
    listed = os.path.join(folder, "scenes.txt")
    with open(listed, "w", encoding="utf-8") as file:
        file.writelines(scene + "\n" for scene in 2 * scenes)
    textured = os.path.join(models, "textured", "textured.glb")
    out = os.path.join(folder, "out")
    return {
        "thumbnails": (f"{2 * len(scenes)} thumbnails of 256 × 256 pixels",
                       [f"@{listed}", "-o", out + "-{index}.png", "--size", "256x256"]),
        "obj": ("an OBJ file of 1.1 million triangles, 1280 × 720 pixels",
                [args.scan, "-o", out + ".png", "--size", "1280x720"]),
        "layers": ("an EXR of 1920 × 1080 pixels with depth, normals, object ids and Cryptomatte",
                   [textured, "-o", out + ".exr", "--size", "1920x1080", "--aov", "depth,normal,object-id,cryptomatte"]),
    }


def read(file):
    """The spans of a trace, outer ones first, and the milliseconds to the end of the last."""
    with open(file, encoding="utf-8") as text:
        trace = json.load(text)
    spans = sorted(trace["traceEvents"], key=lambda span: (span["ts"], -span["dur"]))
    return spans, max(span["ts"] + span["dur"] for span in spans) / 1e3


def run(args, words, file):
    command = [args.blinn, "render", *words, "--threads", str(args.threads), "--quiet", "--trace", file]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr}")


def shortest(args, name, words, folder):
    """The spans of the shortest run."""
    files = [os.path.join(folder, f"{name}-{turn + 1}.json") for turn in range(args.rounds)]
    for file in files:
        if not os.path.exists(file):
            run(args, words, file)
    return min((read(file) for file in files), key=lambda trace: trace[1])


def step(end):
    """Milliseconds between ticks of the axis: 1, 2 or 5 and zeros, some eight ticks in all."""
    power = 1.0
    while end / power > 100:
        power *= 10
    return next(power * digit for digit in (1, 2, 5, 10, 20) if end / (power * digit) <= 10)


def draw(title, spans, end):
    """An SVG: a row for each thread, scenes as a narrow bar over their stages."""
    threads = sorted({span["tid"] for span in spans})
    scale = (WIDTH - LEFT - RIGHT) / end
    height = TOP + len(threads) * (ROW + GAP) + 36
    bottom = height - 36
    parts = []

    def text(x, y, words, anchor="start"):
        parts.append(f'<text class="ink" x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{html.escape(words)}</text>')

    def bar(x, y, w, h, attributes, label=""):
        inside = f"<title>{html.escape(label)}</title>" if label else ""
        parts.append(f'<rect x="{x:.2f}" y="{y:.1f}" width="{w:.2f}" height="{h}" {attributes}>{inside}</rect>')

    text(LEFT, 20, title)
    x = LEFT
    seen = {span["name"] for span in spans if span["dur"] / 1e3 * scale >= 0.2}
    legend = [(name, color) for name, color in COLORS.items() if name in seen]
    if seen - set(COLORS) - {"scene"}:
        legend.append(("other", OTHER))
    for name, color in [("scene", None), *legend]:
        bar(x, 40 if color is None else 36, 12, 5 if color is None else 12, 'class="even"' if color is None else f'fill="{color}"')
        text(x + 17, 47, name)
        x += 17 + 7.2 * len(name) + 18
    for row, thread in enumerate(threads):
        y = TOP + row * (ROW + GAP)
        text(LEFT - 10, y + 20, f"thread {thread}", "end")
        bar(LEFT, y, end * scale, ROW, 'class="idle"')
    for span in spans:
        at, width = LEFT + span["ts"] / 1e3 * scale, span["dur"] / 1e3 * scale
        if width < 0.05:
            continue
        y = TOP + threads.index(span["tid"]) * (ROW + GAP)
        what = span["args"]
        label = f'{span["name"]}, {os.path.basename(what["scene"])}, {span["dur"] / 1e3:.1f} ms'
        if span["name"] == "scene":
            bar(at, y - 6, width, 5, f'class="{"even" if what["index"] % 2 == 0 else "odd"}"', label)
        else:
            edge = ' class="edge" stroke-width="0.4"' if width > 2 else ""
            bar(at, y, width, ROW, f'fill="{COLORS.get(span["name"], OTHER)}"{edge}', label)
    parts.append(f'<line class="axis" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{bottom}" y2="{bottom}"/>')
    between = step(end)
    for tick in range(int(end / between) + 1):
        x = LEFT + tick * between * scale
        parts.append(f'<line class="axis" x1="{x:.1f}" x2="{x:.1f}" y1="{bottom}" y2="{bottom + 5}"/>')
        text(x, bottom + 19, f"{tick * between:g}", "middle")
    text(LEFT - 10, bottom + 19, "ms", "end")
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" viewBox="0 0 {WIDTH} {height}" '
            f'font-family="sans-serif" font-size="13">\n<style>{STYLE}\n</style>\n'
            f'<rect class="page" width="{WIDTH}" height="{height}"/>\n' + "\n".join(parts) + "\n</svg>\n")


def main():
    args = arguments()
    with tempfile.TemporaryDirectory() as temporary:
        folder = args.keep or temporary
        os.makedirs(folder, exist_ok=True)
        for name, (title, words) in jobs(args, folder).items():
            spans, end = shortest(args, name, words, folder)
            with open(os.path.join(IMAGES, f"trace-{name}.svg"), "w", encoding="utf-8") as file:
                file.write(draw(title, spans, end))
            print(f"trace-{name}.svg: {end:.0f} ms")


if __name__ == "__main__":
    main()
