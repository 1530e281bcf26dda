#!/usr/bin/env python3
"""Checks the pages of `blinn bench --report` in Chromium: of one run, and of several machines.

    report.py BLINN [PICTURE.png]

From the file system and without a network: no requests, no errors, no empty plots or pictures, no text outside its
plot. With PICTURE.png, a screenshot is written there.
"""
import base64
import os
import shutil
import sys
import tempfile

from moving import BLINN, Chromium, run

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
    assert "they did the same work" in browser.says("document.body.textContent")
    assert browser.says("document.documentElement.scrollWidth <= window.innerWidth"), "the page is wider than the window"


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        os.chdir(folder)
        browser = Chromium()
        try:
            check(browser)
        finally:
            browser.process.kill()
            browser.process.wait()
