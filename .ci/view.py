#!/usr/bin/env python3
"""Checks `blinn view` in Chromium and with plain sockets.

    view.py BLINN

- The page orbits, pans, zooms, picks, hides and copies; the copied command writes the bytes of the picture shown.
- A changed file appears, and the view stays; a broken file is reported.
- Foreign hosts and origins, wrong tokens and paths get nothing; a client that does not read holds back nobody.
- Everything works by keyboard and has a name; axe-core finds nothing; no errors and no violations of the policy.
"""
import json
import os
import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

from moving import Chromium
from pages import check_looks
from viewer import PATH, Page, Tunnel, Viewer, message

ROOT = Path(__file__).resolve().parents[1]


def check_refusals(viewer):
    assert viewer.request(f"/{viewer.token}/")[0] == 200
    wrong = viewer.token[:-1] + ("0" if viewer.token[-1] != "0" else "1")
    paths = [
        "/", f"/{wrong}/", "/favicon.ico", f"/{viewer.token}/../scene.obj", f"/{viewer.token}/%2e%2e/scene.obj", f"/{viewer.token}/scene.obj",
        f"/{viewer.token}/..%2fscene.obj", f"/{viewer.token}//etc/passwd", f"/{viewer.token}/main.js/../../scene.obj", "/../../etc/passwd",
    ]
    for path in paths:
        status, body = viewer.request(path)
        assert status != 200 and len(body) < 200, (path, status, body)
    for host in ("example.com", f"attacker.localhost.example:{viewer.host.split(':')[1]}", ""):
        assert viewer.request(f"/{viewer.token}/", Host=host)[0] != 200, host
    for method in ("POST", "PUT", "DELETE", "OPTIONS"):
        assert viewer.request(f"/{viewer.token}/", method=method)[0] != 200, method
    assert viewer.open_socket() == 101
    port = viewer.host.split(":")[1]
    for origin in ("http://example.com", "null", f"https://{viewer.host}", f"http://example.com:{port}", f"http://{viewer.host}.example.com"):
        assert viewer.open_socket(Origin=origin) != 101, origin
    assert viewer.open_socket(path=f"/{wrong}/socket") != 101
    # `ssh -L` changes the port.
    assert viewer.open_socket(Host="localhost:1234", Origin="http://localhost:1234") == 101
    print(f"view: {len(paths)} paths, 3 hosts, 4 methods and 5 origins are refused")


def check_gestures(page):
    at_start = page.camera()
    first = page.bytes()
    page.drag((300, 200), (400, 230), release=False)
    # A coarse picture of the moved camera comes while the button is held.
    page.until("m.state.moving && !m.picture.shown.header.final && m.connection.isNewest(m.picture.shown.header)")
    page.pointer("mouseReleased", 400, 230)
    page.settle()
    camera = page.camera()
    assert camera["kind"] == "orbit" and camera != at_start, camera
    assert page.bytes() != first
    page.drag((300, 200), (300, 2000))
    assert page.camera()["elevation"] == 90 and page.camera()["azimuth"] == camera["azimuth"], "flips at the pole"
    page.key("0")
    camera = page.camera()
    page.drag((300, 200), (330, 220), "right")
    panned = page.camera()
    assert panned["target"] != camera["target"] and panned["distance"] == camera["distance"], panned
    # The point under the pointer stays there.
    page.key("0")
    page.key("1")
    project = "c.projectSegment(c.cameraOf(m.state.view.camera, m.picture.aspect), p, p)[0]"
    page.module("globalThis.fixed = (camera => camera.target.map((x, i) => x + [0.3, 0.2, 0][i] * camera.distance * 0.1))(m.state.view.camera)")
    left, top, width, height = page.rect("picture")
    x, y = page.module(f"(p => {project})(globalThis.fixed)")
    page.browser.call("Input.dispatchMouseEvent", type="mouseWheel", x=left + x * width, y=top + y * height, deltaX=0, deltaY=-300)
    page.until("m.state.view.camera.distance < %r * 0.9" % camera["distance"])
    moved = page.module(f"(p => {project})(globalThis.fixed)")
    assert abs(moved[0] - x) * width < 1.5 and abs(moved[1] - y) * height < 1.5, (x, y, moved)
    page.browser.touch("touchStart", (200, 200), (300, 200))
    page.browser.touch("touchMove", (150, 200), (350, 200))
    page.browser.touch("touchEnd")
    page.until("m.state.view.camera.distance < %r * 0.6" % camera["distance"])
    page.key("0")
    page.settle()
    print("view: drags, wheel and pinch")


# Largest distance in pixels between corners of objects in the camera of a frame and in another one, for those in the picture.
APART = """(other => Math.max(...m.scene.objects.flatMap(o => c.edgesOf(o.bounds).flat()).map(p => {
    const [a, b] = [m.picture.camera, other].map(camera => c.projectSegment(camera, p, p)?.[0]);
    const isSeen = a?.every(x => x >= 0 && x <= 1);
    return isSeen ? Math.hypot(...[0, 1].map(k => (a[k] - b[k]) * m.picture.size[k])) : 0;
})))(%s)"""


def check_cameras(page):
    """The page and the renderer place points at the same pixels."""
    for keys in ("5", "o", "70", "o", "10"):
        for name in keys:
            page.key(name)
        page.settle()
        apart = page.module(APART % "c.cameraOf(m.state.view.camera, m.picture.aspect)")
        assert apart < 0.02, (keys, apart)
    print("view: page and renderer place points alike")


def check_picking(page):
    """Clicks on each of some objects, as seen from above, selects it."""
    page.key("7")
    page.settle()
    found = []
    left, top, width, height = page.rect("picture")
    for i, name in enumerate(page.module("m.scene.objects.map(o => o.name)")):
        top_of = "(({min, max}) => [(min[0] + max[0]) / 2, max[1], (min[2] + max[2]) / 2])"
        x, y = page.module(f"(p => c.projectSegment(m.picture.camera, p, p)[0])({top_of}(m.scene.objects[{i}].bounds))")
        page.module("m.state.select(null)")
        page.click(left + x * width, top + y * height)
        time.sleep(0.05)
        page.until("m.connection.isNewest(m.picture.shown.header)")
        end = time.time() + 2
        while (selected := page.module("m.state.selected")) is None and time.time() < end:
            time.sleep(0.02)
        if selected == i:
            found.append(name)
    count = page.module("m.scene.objects.length")
    assert len(found) * 2 > count, (found, count)
    rows = "document.querySelectorAll('#objects [aria-selected=true]').length"
    page.key("Escape")
    page.browser.until(rows, 0)
    page.key("1")
    page.settle()
    print(f"view: clicks select {len(found)} of {count} objects, the others are below")


def check_command(page, folder):
    """Hides an object by keyboard, copies the command and runs it in a shell."""
    shown = page.bytes()
    page.says("document.getElementById('objects').focus()")
    for name in ("Home", "ArrowDown", " "):
        page.key(name)
    page.until("m.state.view.hidden.length", 1)
    page.settle()
    assert page.bytes() != shown, "hiding changes nothing"
    for permission in ("granted", "denied"):
        setting = dict(permission={"name": "clipboard-write"}, setting=permission, origin=page.says("location.origin"))
        page.browser.call("Browser.setPermission", **setting)
        page.press("copy-render")
        page.browser.until("document.getElementById('render-copied').textContent", "Copied")
        page.says("document.getElementById('render-copied').textContent = ''")
    page.says("document.getElementById('search').focus()")
    page.browser.call("Input.dispatchKeyEvent", type="keyDown", key="v", code="KeyV", modifiers=2, commands=["paste"])
    command = page.says("document.getElementById('search').value")
    assert command == page.says("document.getElementById('render-command').value") and command.startswith("blinn render "), command
    page.says("(e => { e.value = ''; e.dispatchEvent(new Event('input')) })(document.getElementById('search'))")
    run_command(page, folder, command)
    turntable = page.says("document.getElementById('turntable-command').value")
    assert not turntable or turntable.startswith("blinn turntable "), turntable
    print(f"view: {command}")


def run_command(page, folder, command):
    """Runs a command in an empty folder, and compares its picture with the one shown."""
    empty = Path(tempfile.mkdtemp(dir=folder))
    for file in folder.iterdir():
        if file.suffix in (".obj", ".mtl", ".glb"):
            shutil.copy(file, empty)
    before = set(empty.iterdir())
    done = subprocess.run(["sh", "-c", command], cwd=empty, env={**os.environ, "PATH": PATH}, capture_output=True, text=True)
    assert done.returncode == 0, (command, done.stderr)
    (written,) = set(empty.iterdir()) - before
    assert written.read_bytes() == page.bytes(), f"{command}: other bytes than the picture shown"


def check_panel(page, folder):
    """Controls change the command, which makes the picture."""
    change = "(e => { e.value = %r; e.dispatchEvent(new Event('change')) })(document.getElementById(%r))"
    page.says(change % ("three-point", "lights"))
    page.says(change % ("transparent", "background"))
    page.says("document.getElementById('ground').click()")
    page.says("document.getElementById('ao-on').click()")
    page.says("document.querySelector('[name=projection][value=orthographic]').click()")
    page.says("document.querySelector('[name=size][value=fixed]').click()")
    page.says(change % ("160", "width"))
    page.says(change % ("120", "height"))
    page.until("m.picture.shown.header.width", 160)
    page.settle()
    command = page.says("document.getElementById('render-command').value")
    for words in ("lights three-point", "background transparent", "ground plane", "ao 16", "projection orthographic", "size 160x120"):
        assert re.search("--%s[= ]'?%s\\b" % tuple(words.split()), command), (words, command)
    run_command(page, folder, command)
    page.says("document.querySelector('[name=size][value=window]').click()")
    page.settle()
    print("view: the panel's settings are in the command, and the bytes are equal")


def replace(file, text):
    """Replaces a file as editors do: under another name, then renamed."""
    Path(f"{file}.new").write_text(text)
    os.replace(f"{file}.new", file)


def check_reload(page, scene):
    def reloads(change):
        generation = page.module("m.scene.generation")
        change()
        page.until(f"m.scene.generation > {generation}")
        page.settle()

    before, view = page.bytes(), page.module("m.state.view")
    text = scene.read_text()
    higher = re.sub(r"^v (\S+) (\S+)", lambda m: f"v {m[1]} {float(m[2]) * 1.25}", text, flags=re.M)
    reloads(lambda: replace(scene, higher))
    assert page.module("m.state.view") == view, "the view has changed"
    assert page.bytes() != before, "the picture has not changed"
    replace(scene, "f 1 2 3\n")
    page.browser.until("document.getElementById('error').hidden", False)
    reason = page.says("document.getElementById('error').textContent")
    assert reason, "no reason"
    # Pictures of the scene before do not hide it.
    samples = page.module("m.state.view.samples")
    for number in (samples + 1, samples):
        page.module(f"m.state.change({{samples: {number}}})")
        page.settle()
    assert page.says("document.getElementById('error').textContent") == reason, "a picture has hidden the reason"
    reloads(lambda: replace(scene, text))
    assert page.says("document.getElementById('error').hidden"), "the error is still shown"
    assert page.bytes() == before, "the old file is not shown again"
    # A material in another file.
    library = scene.with_suffix(".mtl")
    green = re.sub(r"^Kd .*", "Kd 0.1 0.6 0.2", library.read_text(), flags=re.M)
    reloads(lambda: library.write_text(green))
    assert page.bytes() != before, "the material has not changed"
    print("view: changed, broken and repaired files appear, with the same view")


def check_address(page):
    """A reload of the page, and a page at a copied address, show the same view."""
    page.key("0")
    page.drag((300, 200), (340, 230))
    page.module("m.state.change({lights: 'headlight', samples: 2, hidden: [0, 2]})")
    page.settle()
    address = page.says("location.href")
    for word in ("orbit=", "look-at=", "lights=headlight", "samples=2", "hide=0,2"):
        assert word in address.split("#")[1], (word, address)
    # The height is that of an orthographic camera.
    view_of = "(v => ({...v, camera: {...v.camera, height: 0}}))(m.state.view)"
    view, shown = page.module(view_of), page.bytes()
    page.browser.call("Page.reload")
    time.sleep(0.3)
    page.browser.until("document.readyState", "complete")
    page.settle()
    assert page.module(view_of) == view and page.bytes() == shown, "another view after a reload"
    # Nonsense in the address is ignored.
    page.says("location.hash = 'orbit=1,2&samples=-1&hide=9999999-99999999,x&camera=77&exposure=abc&size=1x1&time=Infinity'")
    page.until("JSON.stringify(m.state.view) === JSON.stringify(m.scene.start)")
    page.settle()
    page.says(f"location.hash = {json.dumps(address.split('#')[1])}")
    page.until("m.state.view.samples", 2)
    page.settle()
    assert page.bytes() == shown, "another view after a change of the address"
    page.says("location.hash = ''")
    page.settle()
    print("view: the address holds the view")


def check_folder(browser):
    """Scenes of a folder open by buttons and keys, and the address names them."""
    folder = Path("folder")
    folder.mkdir()
    for name in ("tests/cube.obj", "cornell/cornell.glb", "tower/tower.glb"):
        shutil.copy(ROOT / "models" / name, folder)
    viewer = Viewer(str(folder))
    try:
        browser.call("Page.navigate", url=viewer.url)
        browser.until("document.readyState", "complete")
        page = Page(browser)
        page.settle(60)
        title = "document.getElementById('file').textContent"
        assert page.says(title) == "cornell.glb" and page.says("document.getElementById('previous-file').disabled")
        page.module("m.state.change({samples: 2})")
        page.settle()
        page.press("next-file")
        page.browser.until(title, "cube.obj")
        page.settle(60)
        assert page.module("m.state.view.samples") == 2
        page.says("document.getElementById('stage').focus()")
        page.key("PageDown")
        page.browser.until(title, "tower.glb")
        page.settle(60)
        assert "file=folder/tower.glb" in page.says("location.hash") and page.says("document.getElementById('next-file').disabled")
        page.key("PageUp")
        page.browser.until(title, "cube.obj")
        address = page.says("location.href")
        browser.call("Page.navigate", url="about:blank")
        browser.call("Page.navigate", url=address.replace("cube.obj", "tower.glb"))
        browser.until("document.readyState", "complete")
        page.browser.until(title, "tower.glb")
        page.settle(60)
        assert page.module("m.state.view.samples") == 2
        check_looks(browser, "view", settle=lambda: page.settle(60))
    finally:
        viewer.process.kill()
        viewer.process.wait()
    print("view: scenes of a folder by buttons, keys and address")


def check_slow_reader(viewer, page):
    connection = viewer.connect(receive_buffer=4096)
    view = page.module("m.state.view")
    assert viewer.open_socket(connection) == 101
    for serial in range(1, 4):
        state = dict(type="view", serial=serial, moving=False, size=[1200, 900], pixel_ratio=1, view={**view, "samples": 1, "exposure": serial})
        connection.sendall(message(state))
    half_open = viewer.connect()
    half_open.sendall(b"GET /")
    time.sleep(1)
    since = time.time()
    page.key("ArrowLeft")
    page.settle()
    seconds = time.time() - since
    assert seconds < 10, seconds
    connection.close()
    half_open.close()
    print(f"view: beside a client that does not read, a picture takes {seconds:.1f} s")


def check_keyboard(page):
    """Walks through the page by Tab: every control is reached, has a name, and shows the focus."""
    browser = page.browser
    page.says("document.querySelectorAll('details').forEach(e => { e.open = true })")
    reachable = "Array.from(document.querySelectorAll('button, select, input, textarea, summary, [tabindex=\"0\"]'))" \
        ".filter(e => e.checkVisibility() && !e.disabled && !(e.type === 'radio' && !e.checked)).length"
    count = page.says(reachable)
    page.says("document.getElementById('stage').focus()")
    visited = []
    for _ in range(2 * count):
        page.key("Tab")
        if page.says("document.activeElement === document.body"):
            continue
        if page.says("document.activeElement.id") == "stage":
            break
        visited.append(page.says("(e => e.id || e.name || e.textContent.trim())(document.activeElement)"))
        shows = "(e => [e, e.nextElementSibling].some(f => f && getComputedStyle(f).outlineStyle !== 'none'))(document.activeElement)"
        assert page.says(shows), f"no focus is seen on {visited[-1]}"
    assert len(visited) == count - 1, (len(visited), count, visited)
    nodes = browser.call("Accessibility.getFullAXTree")["nodes"]
    focusable = [n for n in nodes if any(p["name"] == "focusable" and p["value"].get("value") for p in n.get("properties", []))]
    nameless = [n["role"]["value"] for n in focusable if not n.get("name", {}).get("value")]
    assert len(focusable) > 30 and not nameless, nameless
    roles = {n["role"]["value"] for n in nodes}
    assert {"application", "complementary", "listbox", "option", "slider", "status", "alert", "main"} <= roles | {"alert"}, roles
    # The dialog opens by a key, holds the focus, and closes.
    page.says("document.getElementById('stage').focus()")
    page.key("?")
    assert page.says("document.getElementById('keys').open")
    browser.call("Input.dispatchKeyEvent", type="rawKeyDown", key="Escape", code="Escape", windowsVirtualKeyCode=27)
    browser.until("document.getElementById('keys').open", False)
    browser.until("document.activeElement.id", "stage")
    print(f"view: {len(visited)} controls by keyboard, {len(focusable)} names")


def check_axe(page):
    import axe_core_python

    page.says((Path(axe_core_python.__file__).parent / "axe.min.js").read_text() + "; 0")
    rules = "axe.run(document).then(found => found.violations.map(v => [v.id, ...v.nodes.map(n => n.html.slice(0, 200))]))"
    for scheme in ("light", "dark"):
        page.browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        # Colours fade for 120 ms.
        time.sleep(0.3)
        violations = page.says(rules)
        assert violations == [], (scheme, violations)
        page.says("document.getElementById('show-keys').click()")
        violations = page.says(rules)
        assert violations == [], (scheme, "dialog", violations)
        page.says("document.getElementById('keys').close()")
    for width, height in ((360, 640), (640, 360), (1600, 900)):
        page.browser.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        assert page.says("document.documentElement.scrollWidth <= innerWidth"), f"wider than {width} pixels"
        boxes = page.says("['stage', 'panel'].map(id => (r => [r.width, r.height])(document.getElementById(id).getBoundingClientRect()))")
        assert all(side >= 150 for box in boxes for side in box), (width, height, boxes)
    page.browser.call("Emulation.clearDeviceMetricsOverride")
    print("view: axe-core finds nothing, light and dark; small windows fit")


def check_clip(browser):
    """Cameras, animation and flags of a file that has them."""
    viewer = Viewer(str(ROOT / "models/figure/figure.glb"), "--samples", "1")
    try:
        browser.call("Page.navigate", url=viewer.url)
        browser.until("document.readyState", "complete")
        page = Page(browser)
        page.settle()
        assert page.module("m.state.view.samples") == 1
        page.says("document.getElementById('stage').focus()")
        page.key("c")
        page.settle()
        assert page.camera()["kind"] == "file"
        # The orbit starts where the file's camera is.
        apart = page.module(APART % "c.cameraOf(c.orbitOf(m.picture.camera, c.sphereOf(m.scene.bounds)), m.picture.aspect)")
        assert apart < 1, apart
        before = page.bytes()
        slider = "(e => { e.value = %s; e.dispatchEvent(new Event('input')) })(document.getElementById('time'))"
        page.says(slider % "document.getElementById('time').max / 3")
        page.settle()
        assert page.bytes() != before, "the pose has not changed"
        time_shown = page.module("m.state.view.time")
        command = page.says("document.getElementById('render-command').value")
        assert f"--time={time_shown}" in command or f"--time {time_shown}" in command, command
        page.key(" ")
        page.until(f"m.state.view.time !== {time_shown} && m.state.moving && !m.picture.shown.header.final")
        page.key(" ")
        page.settle()
        print("view: cameras and animation of a file")
    finally:
        viewer.process.kill()
        viewer.process.wait()


def check_tunnel(browser, viewer):
    """The page works through another port, and keeps the view when the connection breaks."""
    tunnel = Tunnel(viewer)
    browser.call("Page.navigate", url=tunnel.url)
    browser.until("document.readyState", "complete")
    page = Page(browser)
    page.settle()
    page.says("document.getElementById('stage').focus()")
    for name in ("7", "ArrowDown", "ArrowRight"):
        page.key(name)
    page.module("m.state.change({hidden: [1], samples: 1})")
    page.settle()
    view, shown = page.module("m.state.view"), page.bytes()
    tunnel.breaks()
    browser.until("document.getElementById('notice').hidden", False)
    assert "lost" in page.says("document.getElementById('status').textContent")
    tunnel.works_again()
    browser.until("document.getElementById('notice').hidden", True)
    page.key("ArrowLeft")
    page.key("ArrowRight")
    page.settle()
    assert page.module("m.state.view") == view, (page.module("m.state.view"), view)
    assert page.bytes() == shown
    print("view: through another port, and again after a break")


def check_events(browser):
    bad = [e for e in browser.events if e["method"] == "Runtime.exceptionThrown"]
    bad += [e for e in browser.events if e["method"] == "Log.entryAdded" and e["params"]["entry"]["level"] in ("error", "warning")]
    bad += [e for e in browser.events if e["method"] == "Runtime.consoleAPICalled" and e["params"]["type"] in ("error", "warning")]
    bad += [e for e in browser.events if e["method"] == "Audits.issueAdded" and "ContentSecurityPolicy" in json.dumps(e)]
    assert bad == [], json.dumps(bad)[:2000]
    requested = {e["params"]["request"]["url"] for e in browser.events if e["method"] == "Network.requestWillBeSent"}
    return {url for url in requested if not url.startswith(("about:", "blob:", "data:"))}


def check(viewer, browser, folder, scene):
    for domain in ("Log", "Runtime", "Network", "Audits"):
        browser.call(f"{domain}.enable")
    check_refusals(viewer)
    browser.call("Page.navigate", url=viewer.url)
    browser.until("document.readyState", "complete")
    page = Page(browser)
    page.settle()
    page.says("document.getElementById('stage').focus()")
    check_gestures(page)
    check_cameras(page)
    check_picking(page)
    check_command(page, folder)
    check_panel(page, folder)
    check_reload(page, scene)
    check_address(page)
    page.says("document.getElementById('stage').focus()")
    check_slow_reader(viewer, page)
    check_keyboard(page)
    check_axe(page)
    check_clip(browser)
    check_folder(browser)
    requested = check_events(browser)
    assert requested and all(re.match(r"http://(127\.0\.0\.1|localhost):", url) for url in requested), requested
    print(f"view: no errors, and {len(requested)} files from this host alone")
    check_tunnel(browser, viewer)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        os.chdir(name)
        folder = Path(name) / "scene"
        folder.mkdir()
        for suffix in (".obj", ".mtl"):
            shutil.copy(ROOT / f"models/lecture/lecture{suffix}", folder / f"lecture{suffix}")
        scene = folder / "lecture.obj"
        os.chdir(folder)
        viewer = Viewer(scene.name)
        os.chdir(name)
        browser = Chromium("127.0.0.1")
        try:
            check(viewer, browser, folder, scene)
        finally:
            for process in (browser.process, viewer.process):
                process.kill()
                process.wait()
