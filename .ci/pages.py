"""What all pages of blinn have in common: light and dark, on phones and desktops."""
import base64
import os
from pathlib import Path

WIDTHS = (390, 1280)
SCHEMES = ("light", "dark")
# Sum of the background's channels, 0 to 765.
BRIGHTNESS = "getComputedStyle(document.body).backgroundColor.match(/\\d+/g).slice(0, 3).reduce((a, b) => a + Number(b), 0)"
# Elements that reach beyond the window, but for those that scroll by themselves.
WIDE = """Array.from(document.body.querySelectorAll('*')).filter(e => e.checkVisibility() && !e.closest('.scrolls, svg, .hidden')
    && getComputedStyle(e).position !== 'absolute' && e.getBoundingClientRect().right > innerWidth + 1)
    .map(e => e.outerHTML.slice(0, 120)).slice(0, 3)"""


def resize(browser, width, height=800):
    browser.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600)


def check_looks(browser, name, height=800, settle=lambda: None):
    """Checks a page in both colour schemes and widths. With BLINN_SHOTS=FOLDER, writes a screenshot of each."""
    for scheme in SCHEMES:
        browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        for width in WIDTHS:
            resize(browser, width, height)
            settle()
            brightness = browser.says(BRIGHTNESS)
            assert brightness < 150 if scheme == "dark" else brightness > 600, (name, scheme, brightness)
            scrolls = browser.says("document.documentElement.scrollWidth - innerWidth")
            assert scrolls <= 0, f"{name} is {scrolls} pixels wider than a window of {width}"
            assert browser.says("innerWidth") == width, (name, width, browser.says("innerWidth"))
            assert browser.says(WIDE) == [], (name, width, browser.says(WIDE))
            assert browser.says("getComputedStyle(document.body).fontFamily").startswith("system-ui"), name
            if folder := os.environ.get("BLINN_SHOTS"):
                shot = browser.call("Page.captureScreenshot")
                Path(folder, f"{name}-{width}-{scheme}.png").write_bytes(base64.b64decode(shot["data"]))
    browser.call("Emulation.setEmulatedMedia", features=[])
    browser.call("Emulation.clearDeviceMetricsOverride")
