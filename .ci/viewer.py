"""`blinn view` as a process, and its page in Chromium: for view.py, and for the gallery."""
import base64
import json
import os
import re
import socket
import subprocess
import tempfile
import threading
from pathlib import Path

from moving import BLINN, Chromium

PATH = f"{os.path.dirname(BLINN)}{os.pathsep}{os.environ['PATH']}"
# The page's modules are the ones that it runs, not copies.
PAGE = "Promise.all(['main', 'camera'].map(name => import(`./${name}.js`))).then(([m, c]) => %s)"
SETTLED = "m.picture.shown?.header.final === true && !m.state.moving && m.connection.isNewest(m.picture.shown.header)"


class Viewer:
    """`blinn view` as a process."""

    def __init__(self, *words):
        self.process = subprocess.Popen([BLINN, "view", *words], stdout=subprocess.PIPE, text=True, env={**os.environ, "PATH": PATH})
        self.url = re.search(r"http://\S+", self.process.stdout.readline())[0]
        self.host, self.token = re.fullmatch(r"http://([^/]+)/([^/]+)/", self.url).groups()

    def connect(self, receive_buffer=None):
        connection = socket.socket()
        if receive_buffer:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        connection.settimeout(10)
        name, port = self.host.split(":")
        connection.connect((name, int(port)))
        return connection

    def request(self, path, method="GET", connection=None, **headers):
        """Sends a request and returns the status and the body, or 0 if the connection is closed without an answer."""
        connection = connection or self.connect()
        headers = {"Host": self.host, **{name.replace("_", "-"): value for name, value in headers.items()}}
        lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in headers.items())]
        connection.sendall("\r\n".join([*lines, "", ""]).encode())
        answer = b""
        try:
            while b"\r\n\r\n" not in answer or b" 101 " not in answer:
                part = connection.recv(65536)
                if not part:
                    break
                answer += part
        except ConnectionResetError:
            pass
        if not answer:
            return 0, b""
        head, _, body = answer.partition(b"\r\n\r\n")
        return int(head.split()[1]), body

    def open_socket(self, connection=None, **headers):
        upgrade = dict(Upgrade="websocket", Connection="Upgrade", Sec_WebSocket_Version="13", Sec_WebSocket_Key="AAAAAAAAAAAAAAAAAAAAAA==")
        headers = {"path": f"/{self.token}/socket", "Origin": f"http://{self.host}", **headers}
        path = headers.pop("path")
        return self.request(path, connection=connection, **upgrade, **headers)[0]


class Tunnel:
    """Another port that leads to a viewer, as that of `ssh -L`."""

    def __init__(self, viewer):
        self.viewer = viewer
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self.listener.getsockname()[1]}/{viewer.token}/"
        self.connections = []
        self.is_broken = False
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            near, _ = self.listener.accept()
            if self.is_broken:
                near.close()
                continue
            far = self.viewer.connect()
            far.settimeout(None)
            self.connections += [near, far]
            for source, target in ((near, far), (far, near)):
                threading.Thread(target=self.copy, args=(source, target), daemon=True).start()

    @staticmethod
    def copy(source, target):
        try:
            while data := source.recv(65536):
                target.sendall(data)
            target.shutdown(socket.SHUT_WR)
        except OSError:
            pass

    def breaks(self):
        self.is_broken = True
        for connection in self.connections:
            try:
                connection.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def works_again(self):
        self.is_broken = False


def message(value):
    """Returns a text message of a WebSocket client, masked with zeros."""
    text = json.dumps(value).encode()
    length = bytes([0x80 | 126]) + len(text).to_bytes(2, "big") if len(text) > 125 else bytes([0x80 | len(text)])
    return b"\x81" + length + bytes(4) + text


class Page:
    """The page in the browser."""

    def __init__(self, browser):
        self.browser = browser
        self.says = browser.says

    def module(self, expression):
        return self.says(PAGE % expression)

    def until(self, expression, expected=True, seconds=20):
        self.browser.until(PAGE % f"({expression})", expected, seconds)

    def settle(self, seconds=20):
        """Waits for the final picture and its command."""
        self.until(SETTLED, seconds=seconds)
        self.browser.until("document.getElementById('render-command').ariaBusy", "false")

    def camera(self):
        return self.module("m.state.view.camera")

    def bytes(self):
        url = "new Promise(done => Object.assign(new FileReader(), {onload() { done(this.result) }}).readAsDataURL(m.picture.shown.blob))"
        return base64.b64decode(self.module(url).split(",")[1])

    def key(self, name, shift=False):
        text = {"text": name} if len(name) == 1 else {"text": "\r"} if name == "Enter" else {}
        for kind in ("keyDown", "keyUp"):
            parameters = dict(type=kind, key=name, code=name, modifiers=8 if shift else 0)
            self.browser.call("Input.dispatchKeyEvent", **parameters, **(text if kind == "keyDown" else {}))

    def pointer(self, kind, x, y, button="left", **more):
        held = 0 if kind == "mouseReleased" else {"left": 1, "right": 2}[button]
        self.browser.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=held, **{"clickCount": 1, **more})

    def drag(self, start, end, button="left", release=True):
        self.pointer("mousePressed", *start, button)
        for step in range(1, 6):
            at = [a + (b - a) * step / 5 for a, b in zip(start, end)]
            self.pointer("mouseMoved", *at, button)
        if release:
            self.pointer("mouseReleased", *end, button)

    def click(self, x, y):
        self.pointer("mousePressed", x, y)
        self.pointer("mouseReleased", x, y)

    def rect(self, name):
        """Returns the left and top edge, the width and the height of an element."""
        return self.says(f"(r => [r.left, r.top, r.width, r.height])(document.getElementById('{name}').getBoundingClientRect())")

    def press(self, button):
        """Clicks a button of the panel as a user does, so that the browser lets it copy."""
        self.says(f"document.getElementById('{button}').scrollIntoView({{block: 'nearest'}})")
        left, top, width, height = self.rect(button)
        self.click(left + width / 2, top + height / 2)


def picture_page(words, file, script, size=(1280, 800)):
    """Writes a screenshot of the page of `blinn view WORDS`, dark, after a script has run in it."""
    viewer = Viewer(*words)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Chromium("127.0.0.1", profile)
        try:
            browser.call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=False)
            browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
            browser.call("Page.navigate", url=viewer.url)
            browser.until("document.readyState", "complete")
            page = Page(browser)
            page.settle(120)
            page.module(script)
            page.settle(120)
            Path(file).write_bytes(base64.b64decode(browser.call("Page.captureScreenshot")["data"]))
        finally:
            for process in (browser.process, viewer.process):
                process.kill()
                process.wait()
