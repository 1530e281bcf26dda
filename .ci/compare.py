#!/usr/bin/env python3
"""Checks comparisons, sheets and thumbnails with other programs.

    compare.py BLINN

- `diff --flip` has the errors of NVIDIA's flip-evaluator, if that is installed.
- The page of `diff -o` works in Chromium: without a network, by pointer and by keyboard, dark and light.
- The pixels of a sheet lie where the matrices of its JSON say.
- The thumbnailer of the Debian package works in a sandbox that has only /usr and the file, if bubblewrap is installed.
"""
import configparser
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from moving import BLINN, Chromium
from pages import check_looks

ROOT = Path(__file__).resolve().parents[1]


def run(*words, code=0):
    done = subprocess.run([BLINN, *map(str, words)], capture_output=True, text=True)
    assert done.returncode == code, (words, done.returncode, done.stderr)
    return done.stdout


def check_flip():
    tower = ROOT / "models/tower/tower.glb"
    run("render", tower, "--size", "200x150", "-o", "a.png")
    run("render", tower, "--size", "200x150", "--kd", ".5,.3,.2", "-o", "b.png")
    view = json.loads(run("diff", "a.png", "b.png", "--flip", "--json", code=1))["views"][0]
    try:
        import flip_evaluator
    except ImportError:
        print("!! skipped: flip-evaluator is not installed")
        return
    pictures = [np.asarray(Image.open(name).convert("RGB"), np.float32) / 255 for name in ("a.png", "b.png")]
    errors, mean, _ = flip_evaluator.evaluate(*pictures, "LDR", inputsRGB=True, applyMagma=False)
    assert abs(view["mean"] - mean) < 1e-4 and abs(view["max"] - errors.max()) < 1e-3, (view["mean"], mean)
    print(f"FLIP: mean {view['mean']:.5f}, NVIDIA's {mean:.5f}")


def check_page(browser):
    lecture = (ROOT / "models/lecture/lecture.obj").read_text()
    Path("old.obj").write_text(lecture)
    lines = lecture.splitlines()
    vertex = max(i for i, line in enumerate(lines) if line.startswith("v "))
    x, y, z = map(float, lines[vertex].split()[1:4])
    lines[vertex] = f"v {x} {y + 0.02} {z}"
    Path("new.obj").write_text("\n".join(lines) + "\n")
    found = json.loads(run("diff", "old.obj", "new.obj", "-o", "diff.html", "--json", code=1))
    assert len(found["objects"]) == 1 and any(view["changed_pixels"] for view in found["views"]), found
    browser.open("diff.html")
    assert browser.says("document.querySelectorAll('.view').length") == 4
    browser.until("Array.from(document.images).every(i => i.complete && i.naturalWidth == 640)", True)
    assert browser.says("performance.getEntriesByType('resource').filter(r => !r.name.startsWith('data:')).length") == 0
    assert browser.says("document.documentElement.scrollWidth <= window.innerWidth"), "the page is wider than the window"
    # Every control has a name, and every picture a text.
    unnamed = "Array.from(document.querySelectorAll('input')).filter(i => !i.labels.length && !i.ariaLabel).length"
    assert browser.says(unnamed) == 0
    assert browser.says("Array.from(document.images).every(i => i.alt)")
    # By keyboard: the radio buttons, then the slider.
    different = "document.querySelector('.view.different')"
    mode = f"{different}.querySelector('.stage').dataset.mode"
    browser.says(f"{different}.querySelector('input[type=radio]:checked').focus()")
    assert browser.says(mode) == "slider"

    def key(name, code):
        for kind in ("rawKeyDown", "keyUp"):
            browser.call("Input.dispatchKeyEvent", type=kind, key=name, code=name, windowsVirtualKeyCode=code)

    for expected in ("before", "after", "difference", "slider"):
        key("ArrowRight", 39)
        browser.until(mode, expected)
    browser.says(f"{different}.querySelector('input[type=range]').focus()")
    key("ArrowRight", 39)
    browser.until(f"{different}.querySelector('.stage').style.getPropertyValue('--split')", "51%")
    check_looks(browser, "diff")
    print(f"diff.html: {os.path.getsize('diff.html')} bytes, by pointer and keyboard, light and dark")


def check_sheet():
    sheet = json.loads(run("sheet", ROOT / "models/tests/cube.obj", "-o", "sheet.png", "--json", "--background", "#ff00ff"))
    pixels = np.asarray(Image.open("sheet.png").convert("RGB")).astype(int)
    low, high = (np.array(sheet["bounds"][end]) for end in ("min", "max"))
    corners = np.array([[*np.where([i & 1, i & 2, i & 4], high, low), 1] for i in range(8)])
    for cell in sheet["cells"][2:]:
        projected = corners @ np.array(cell["model_to_pixel"]).T
        left, top = projected.min(axis=0)
        right, bottom = projected.max(axis=0)
        row = pixels[int((top + bottom) / 2)]
        rect = cell["rect"]
        inside = np.arange(rect["x"] + 200, rect["x"] + rect["width"] - 20)
        covered = inside[np.abs(row[inside] - [255, 0, 255]).sum(axis=1) > 60]
        # The filter blurs edges by a pixel and a half.
        assert abs(covered.max() - right) < 2.5, (cell["view"], covered.max(), right)
    print("sheet.json: its matrices lead to the pixels")


def check_thumbnailer():
    if not shutil.which("bwrap"):
        print("!! skipped: bubblewrap is not installed")
        return
    entry = configparser.ConfigParser(interpolation=None)
    entry.read(ROOT / "docs/packaging/blinn.thumbnailer")
    command = entry["Thumbnailer Entry"]["Exec"]
    os.makedirs("out", exist_ok=True)
    Path("broken.glb").write_text("glTF")
    good = [ROOT / "models/still-life/still-life.glb", ROOT / "models/tests/cube.obj"]
    for source in [*good, Path("broken.glb")]:
        inside = f"/tmp/thumbnailed{source.suffix}"
        values = {"%s": "128", "%i": inside, "%o": "/tmp/out/thumbnail.png", "%u": f"file://{inside}"}
        words = [values.get(word, word) for word in command.split()]
        sandbox = ["bwrap", "--ro-bind", "/usr", "/usr", "--unshare-all", "--die-with-parent", "--proc", "/proc", "--dev", "/dev"]
        for link in ("lib", "lib64", "bin", "sbin"):
            sandbox += ["--symlink", f"usr/{link}", f"/{link}"]
        sandbox += ["--tmpfs", "/tmp", "--ro-bind", source.resolve(), inside, "--bind", os.path.abspath("out"), "/tmp/out"]
        sandbox += ["--ro-bind", BLINN, "/tmp/bin/blinn", "--setenv", "PATH", "/tmp/bin:/usr/bin"]
        done = subprocess.run([*map(str, sandbox), *words], capture_output=True, text=True, timeout=30)
        if source in good:
            assert done.returncode == 0 and not done.stdout, (source.name, done.stderr)
            assert max(Image.open("out/thumbnail.png").size) == 128
            os.remove("out/thumbnail.png")
        else:
            assert done.returncode == 1 and "broken" not in os.listdir("out") and not os.listdir("out"), done.stderr
    print("thumbnails: in a sandbox with only /usr and the file")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        os.chdir(folder)
        check_flip()
        check_sheet()
        check_thumbnailer()
        browser = Chromium()
        try:
            check_page(browser)
        finally:
            browser.process.kill()
            browser.process.wait()
