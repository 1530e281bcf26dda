#!/usr/bin/env python3
"""Checks blinn's animation files in ffprobe, ffmpeg and Chromium.

    moving.py BLINN

Twenty-four frames of known colours are written in every format. ffmpeg counts, times and decodes them. Chromium plays
the MP4 and turns the page by drag, touch and keys, from the file system and without a network. Needs pillow and numpy.
"""
import json
import os
import subprocess
import sys
import tempfile
import time

import numpy as np
from PIL import Image

from pages import check_looks, resize

BLINN = os.path.abspath(sys.argv[1])
W, H, COUNT, FPS = 161, 90, 24, 12  # odd width: the MP4 has an extra column


def frame(i):
    """Returns a frame: its own colour, a horizontal ramp and a moving bar."""
    x, y = np.meshgrid(np.linspace(0, 1, W), np.linspace(0, 1, H))
    picture = np.stack([40 + 8 * i + 0 * x, 60 + 120 * x, 200 - 100 * y], -1)
    picture[30:60, (i * 6) % W : (i * 6) % W + 8] = (250, 240, 20)
    return picture.astype(np.uint8)


def run(*command):
    done = subprocess.run(command, capture_output=True)
    assert done.returncode == 0, f"{command}: {done.stderr.decode()[-2000:]}"
    return done.stdout


def probe(file):
    asked = ["-v", "error", "-count_frames", "-show_streams", "-of", "json"]
    return json.loads(run("ffprobe", *asked, file))["streams"][0]


def decoded(file, width=W):
    out = run("ffmpeg", "-v", "error", "-i", file, "-f", "rawvideo", "-pix_fmt", "rgb24", "-fps_mode", "passthrough", "-")
    return np.frombuffer(out, np.uint8).reshape(-1, H, width, 3)[:, :, :W].astype(float)


def psnr(a, b):
    return 10 * np.log10(255**2 / max(np.mean((a - b) ** 2), 1e-9))


def files():
    """Checks frame count, frame rate and pixels of every format that ffmpeg reads."""
    sources = np.stack([frame(i) for i in range(COUNT)]).astype(float)
    for name, least in (("a.gif", 34), ("a.apng", 90), ("a.mp4", 36)):
        run(BLINN, "assemble", "frames", "-o", name, "--fps", str(FPS))
        stream = probe(name)
        assert int(stream["nb_read_frames"]) == COUNT, stream
        a, b = map(int, stream["avg_frame_rate"].split("/"))
        assert abs(a / b - FPS) < 0.02, stream["avg_frame_rate"]
        frames = decoded(name, W + 1 if name == "a.mp4" else W)
        worst = min(psnr(a, b) for a, b in zip(frames, sources, strict=True))
        assert worst > least, f"{name}: {worst:.1f} dB"
        print(f"{name}: {COUNT} frames, {os.path.getsize(name)} bytes, at least {worst:.1f} dB")
    video = probe("a.mp4")
    expected = dict(codec_name="h264", pix_fmt="yuv420p", width=W + 1, height=H, color_space="bt709", color_range="tv")
    assert {k: video[k] for k in expected} == expected, video
    assert video["level"] == 30 and video["profile"] == "High", (video["level"], video["profile"])
    data = open("a.mp4", "rb").read()
    assert data.index(b"moov") < data.index(b"mdat"), "the index must come first"
    # ffmpeg 5 reads no animated WebP; Pillow does, with libwebp.
    run(BLINN, "assemble", "frames", "-o", "a.webp", "--fps", str(FPS), "--encoder-quality", "100")
    with Image.open("a.webp") as webp:
        assert webp.n_frames == COUNT and webp.info["loop"] == 0
        for i in range(COUNT):
            webp.seek(i)
            assert (np.asarray(webp.convert("RGB")) == frame(i)).all(), f"a.webp: frame {i}"
    print(f"a.webp: {COUNT} frames, {os.path.getsize('a.webp')} bytes, exact")


class Chromium:
    """A headless browser, controlled through a pipe. It reaches only the host that is named, if any."""

    def __init__(self, host=None, profile="profile"):
        from_us, to_browser = os.pipe()
        from_browser, to_us = os.pipe()
        self.out, self.inn = os.fdopen(to_browser, "wb", 0), os.fdopen(from_browser, "rb")

        def pipes():
            low, high = os.dup(from_us), os.dup(to_us)
            os.dup2(low, 3)
            os.dup2(high, 4)

        flags = "--headless=new --no-sandbox --disable-gpu --remote-debugging-pipe --autoplay-policy=no-user-gesture-required"
        offline = "--host-resolver-rules=MAP * ~NOTFOUND" + (f", EXCLUDE {host}" if host else "")
        profile = f"--user-data-dir={os.path.abspath(profile)}"
        command = ["chromium", *flags.split(), offline, profile, "--window-size=800,600", "about:blank"]
        self.process = subprocess.Popen(command, preexec_fn=pipes, close_fds=False, stderr=subprocess.DEVNULL)
        os.close(from_us), os.close(to_us)
        self.number = 0
        self.events = []
        target = next(t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self.session = None
        self.session = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        self.call("Page.enable")

    def call(self, method, **params):
        self.number += 1
        message = dict(id=self.number, method=method, params=params)
        if getattr(self, "session", None):
            message["sessionId"] = self.session
        self.out.write(json.dumps(message).encode() + b"\0")
        while True:
            answer = bytearray()
            while (byte := self.inn.read(1)) != b"\0":
                assert byte, "the browser has exited"
                answer += byte
            answer = json.loads(answer)
            if answer.get("id") == self.number:
                assert "error" not in answer, answer
                return answer["result"]
            self.events.append(answer)

    def says(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def until(self, expression, expected, seconds=20):
        end = time.time() + seconds
        while (value := self.says(expression)) != expected:
            assert time.time() < end, f"{expression} is {value}, not {expected}"
            time.sleep(0.05)

    def open(self, file, hash=""):
        # Via a blank page: a change of the hash alone does not reload.
        self.call("Page.navigate", url="about:blank")
        self.call("Page.navigate", url="file://" + os.path.abspath(file) + hash)
        self.until("document.readyState", "complete")

    def mouse(self, kind, x, y):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def touch(self, kind, *points):
        self.call("Input.dispatchTouchEvent", type=kind, touchPoints=[dict(x=x, y=y) for x, y in points])

    def key(self, name):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=name, code=name)


def looks(browser):
    """Checks that the picture fills the window, and that the hint shows until the first drag."""
    hint = "document.getElementById('hint').checkVisibility()"
    assert browser.says(hint), "no hint"
    check_looks(browser, "turntable")
    for width, height in ((390, 800), (1280, 700), (800, 600)):
        resize(browser, width, height)
        sides = browser.says("(r => [r.width, r.height])(document.getElementById('picture').getBoundingClientRect())")
        expected = min(width, height * W / H)
        assert abs(sides[0] - expected) < 1 and abs(sides[1] - expected * H / W) < 1, (sides, width, height)
    browser.mouse("mousePressed", 400, 300)
    browser.mouse("mouseMoved", 405, 300)
    assert not browser.says(hint), "the hint stays"
    browser.mouse("mouseReleased", 405, 300)
    browser.key("Home")
    browser.open("a.html")
    assert not browser.says(hint), "the hint shows again"


def turns(browser):
    """Checks that the page shows the right frame after drag, touch and keys."""
    run(BLINN, "assemble", "frames", "-o", "a.html", "--fps", str(FPS))
    browser.open("a.html")
    drawn = "Number(document.getElementById('picture').dataset.drawn)"

    def shows(number):
        browser.until(drawn, number)
        pixel = "Array.from(document.getElementById('picture').getContext('2d').getImageData(80, 80, 1, 1).data)"
        found, expected = np.array(browser.says(pixel)), [*frame(number - 1)[80, 80], 255]
        assert np.abs(found - expected).max() <= 6, f"frame {number}: {found} for {expected}"

    shows(1)
    looks(browser)
    shows(1)
    left, top, width, height = browser.says(
        "(r => [r.left, r.top, r.width, r.height])(document.getElementById('picture').getBoundingClientRect())"
    )
    y = top + height / 2
    at = lambda share: left + share * width
    browser.mouse("mousePressed", at(0.2), y)
    for step in range(1, 11):
        browser.mouse("mouseMoved", at(0.2 + 0.026 * step) , y)
    browser.mouse("mouseReleased", at(0.46), y)
    shows(1 + int(0.26 * COUNT))
    # To the left, past the first frame: wraps around.
    browser.mouse("mousePressed", at(0.9), y)
    browser.mouse("mouseMoved", at(0.44), y)
    browser.mouse("mouseReleased", at(0.44), y)
    shows(1 + int(0.26 * COUNT + COUNT - 0.46 * COUNT))
    browser.key("Home")
    shows(1)
    browser.key("ArrowRight")
    shows(2)
    browser.key("ArrowLeft"), browser.key("ArrowLeft")
    shows(COUNT)
    browser.key("Home")
    browser.touch("touchStart", (at(0.1), y))
    for step in range(1, 11):
        browser.touch("touchMove", (at(0.1 + 0.051 * step), y))
    browser.touch("touchEnd")
    shows(1 + int(0.51 * COUNT))
    assert browser.says("document.getElementById('picture').getAttribute('aria-valuenow')") == str(1 + int(0.51 * COUNT))
    assert browser.says("performance.getEntriesByType('resource').filter(r => !r.name.startsWith('data:')).length") == 0
    # The play button starts and stops.
    browser.key("Home")
    browser.says("document.getElementById('play').click()")
    browser.until(f"{drawn} > 4", True)
    browser.says("document.getElementById('play').click()")
    still = browser.says(drawn)
    time.sleep(0.3)
    assert browser.says(drawn) in (still, still + 1)
    browser.open("a.html", "#play")
    browser.until(f"{drawn} > 4", True)
    print(f"a.html: {os.path.getsize('a.html')} bytes, turned by mouse, touch and keys, and played")


def plays(browser):
    """Checks that the MP4 plays to its end."""
    with open("video.html", "w") as page:
        page.write("<video id=v src=a.mp4 muted autoplay></video>")
    browser.open("video.html")
    browser.until("document.getElementById('v').ended", True)
    size, frames, seconds = browser.says(
        "(v => [[v.videoWidth, v.videoHeight], v.getVideoPlaybackQuality().totalVideoFrames, v.duration])"
        "(document.getElementById('v'))"
    )
    assert size == [W + 1, H] and frames > COUNT / 2 and abs(seconds - COUNT / FPS) < 0.01, (size, frames, seconds)
    print(f"a.mp4: Chromium played {frames} frames in {seconds} s")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        os.chdir(folder)
        os.mkdir("frames")
        for i in range(COUNT):
            Image.fromarray(frame(i)).save(f"frames/f_{i + 1}.png")
        files()
        browser = Chromium()
        try:
            turns(browser)
            plays(browser)
        finally:
            browser.process.kill()
            browser.process.wait()
