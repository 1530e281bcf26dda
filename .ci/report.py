#!/usr/bin/env python3
"""Checks the pages of `blinn bench --report` and `blinn render --report` in Chromium.

    report.py BLINN [PICTURE.png]

From the file system and without a network: no requests, no errors, no empty plots or pictures, no text outside its
plot; filters for scenes that failed or have warnings; light and dark, on phones and desktops. With PICTURE.png, a screenshot is written there.
"""
import base64
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from moving import BLINN, Chromium, run
from pages import check_looks, resize

ROOT = Path(__file__).resolve().parents[1]

PICTURE = os.path.abspath(sys.argv[2]) if len(sys.argv) > 2 else None
LITTLE = "--size 160x90 --threads 1,2 -q".split()
PARTS = ["compared", "stages", "rays", "threads", "steps", "figures"]

# Texts outside their drawing, and empty drawings.
OUTSIDE = """Array.from(document.querySelectorAll('svg text')).filter(t => {
    const a = t.getBoundingClientRect(), b = t.closest('svg').getBoundingClientRect();
    return a.left < b.left - 1 || a.right > b.right + 1 || a.top < b.top - 1 || a.bottom > b.bottom + 1;
}).map(t => t.textContent)"""
EMPTY = """Array.from(document.querySelectorAll('svg, img')).filter(e => {
    const r = e.getBoundingClientRect();
    return r.width < 50 || r.height < 10 || (e.tagName == 'IMG' && e.naturalWidth != 160);
}).length"""


def check(browser):
    run(BLINN, "bench", "--suite", "3k", *LITTLE, "--rounds", "1", "--json", "a.json")
    run(BLINN, "bench", "--suite", "2k,4k", *LITTLE, "--rounds", "1", "--compare", "a.json", "--report", "report.html")
    browser.call("Log.enable")
    browser.open("report.html")
    assert browser.says("Array.from(document.querySelectorAll('h2')).map(h => h.id)") == PARTS
    assert browser.says("performance.getEntriesByType('resource').filter(r => !r.name.startsWith('data:')).length") == 0
    browser.until("Array.from(document.images).every(i => i.complete)", True)
    assert browser.says(EMPTY) == 0, "a plot or a picture is empty"
    assert browser.says(OUTSIDE) == [], browser.says(OUTSIDE)
    plots, pictures = (browser.says(f"document.querySelectorAll('{kind}').length") for kind in ("svg", "img"))
    scenes = 12  # seven kinds, five of them in both sizes
    assert pictures == scenes and plots == 2 * scenes + 2, (plots, pictures)
    assert browser.says("document.documentElement.scrollWidth <= window.innerWidth"), "the page is wider than the window"
    check_looks(browser, "bench")
    assert browser.says(OUTSIDE) == [], browser.says(OUTSIDE)
    if PICTURE:
        shot = browser.call("Page.captureScreenshot", captureBeyondViewport=True)
        with open(PICTURE, "wb") as file:
            file.write(base64.b64decode(shot["data"]))
    machines(browser)
    print(f"report.html: {os.path.getsize('report.html')} bytes, {plots} plots and {pictures} pictures, without a network")


def machines(browser):
    """The page of several machines has a table of them, and one for each scene with ratios."""
    names = ["desk", "laptop", "server"]
    for name in names:
        shutil.copy("a.json", f"{name}.json")
    run(BLINN, "bench", "--from", *(f"{name}.json" for name in names), "--report", "machines.html")
    browser.open("machines.html")
    assert browser.says("performance.getEntriesByType('resource').filter(r => !r.name.startsWith('data:')).length") == 0
    assert browser.says("document.querySelectorAll('table').length") == 1 + 7
    heads = browser.says("Array.from(document.querySelectorAll('table')[1].rows[0].cells).map(c => c.textContent)")
    assert heads == ["stage", "pixels", "threads", "desk", "laptop", "time / desk", "server", "time / desk", "hash"], heads
    check_looks(browser, "machines")
    assert "they did the same work" in browser.says("document.body.textContent")
    assert browser.says("document.documentElement.scrollWidth <= window.innerWidth"), "the page is wider than the window"


SHOWN = "Array.from(document.querySelectorAll('.scene')).filter(e => e.checkVisibility()).map(e => e.querySelector('h2').textContent)"


def scenes(browser):
    """The page of `render --report` filters scenes by outcome and by name."""
    os.mkdir("scenes")
    for kind in ("tower/tower.glb", "cornell/cornell.glb", "tests/cube.obj", "alpha/alpha.glb"):
        shutil.copy(ROOT / "models" / kind, "scenes")
    Path("scenes/broken.obj").write_text("f 1 2 3\n")
    Path("scenes/warned.obj").write_text("mtllib missing.mtl\n" + (ROOT / "models/tests/cube.obj").read_text())
    line = "render scenes -o out/{stem}.png --size 160x120 -s 1 --report out/report.html -q".split()
    assert subprocess.run([BLINN, *line], capture_output=True).returncode == 1
    browser.open("out/report.html")
    assert browser.says("performance.getEntriesByType('resource').filter(r => !r.name.startsWith('data:')).length") == 0
    everything = browser.says(SHOWN)
    assert len(everything) == 6, everything
    assert browser.says("Array.from(document.images).every(i => i.alt)")
    choose = "document.querySelector('input[name=show][value=%s]').click()"
    browser.says(choose % "failed")
    assert browser.says(SHOWN) == ["scenes/broken.obj"], browser.says(SHOWN)
    assert browser.says("document.getElementById('count').textContent") == "1 of 6 scenes"
    assert browser.says("location.hash") == "#failed"
    browser.says(choose % "warned")
    assert "scenes/warned.obj" in browser.says(SHOWN) and "scenes/broken.obj" not in browser.says(SHOWN)
    browser.says(choose % "all")
    browser.says("(e => { e.value = 'CORN'; e.dispatchEvent(new Event('input', {bubbles: true})) })(document.getElementById('search'))")
    assert browser.says(SHOWN) == ["scenes/cornell.glb"], browser.says(SHOWN)
    browser.open("out/report.html", "#failed")
    assert browser.says(SHOWN) == ["scenes/broken.obj"]
    browser.open("out/report.html")
    check_looks(browser, "report")
    columns = "new Set(Array.from(document.querySelectorAll('.scene')).map(e => e.getBoundingClientRect().left)).size"
    resize(browser, 1280)
    assert browser.says(columns) >= 4
    resize(browser, 390)
    assert browser.says(columns) == 1
    print(f"out/report.html: {os.path.getsize('out/report.html')} bytes, filters by outcome and name")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        os.chdir(folder)
        browser = Chromium()
        try:
            check(browser)
            scenes(browser)
        finally:
            browser.process.kill()
            browser.process.wait()
