"""Runs what README and docs tell to type, and follows their links.

    python .ci/docs.py BLINN [PAGE…]

Each page's blocks run in order in a folder of their own, which holds the models and has BLINN on its PATH:
- ```sh: run by bash; each line has to succeed.
- ```console: `$ command` and what it prints, where … stands for anything.
- ```sh needs NAME…: only where these programs are there (`bpy` is a Python that has it).
- ```sh clone: not run: these are of a clone, and .ci/run has its own way to them.
- ```sh gallery: not run: docs/scripts/gallery.py runs them, and writes their page.
- ```sh farm: not run: these are of a farm, and .ci/farm.py runs their like.
"""

import fnmatch
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parents[1]
FENCE = re.compile(r"^```(.*?)\n(.*?)^```$", re.S | re.M)
# [text](target) and ![text](target), in which text may hold an image.
LINK = re.compile(r"\]\(\s*<?([^()\s>]+)>?\s*\)")


def pages():
    top = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md", "models/README.md")]
    return top + sorted((ROOT / "docs").rglob("*.md"))


def is_there(program):
    if program == "bpy":
        return subprocess.run(["python", "-c", "import bpy"], capture_output=True).returncode == 0
    return shutil.which(program) is not None


def run(command, folder):
    return subprocess.run(
        ["bash", "-euo", "pipefail", "-c", command], cwd=folder, stdin=subprocess.DEVNULL, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )


def commands(text):
    """Commands line by line; those that end in a backslash or hold a here-document go on."""
    return [text] if "<<" in text else re.sub(r"\\\n", " ", text).splitlines()


def script(text, folder):
    wrong, count = [], 0
    for command in commands(text):
        if command.strip() and not command.lstrip().startswith("#"):
            count += 1
            done = run(command, folder)
            if done.returncode:
                wrong.append(f"{command}\n    exit code {done.returncode}: {done.stdout.strip()[-600:]}")
    return count, wrong


def session(text, folder):
    wrong, count = [], 0
    for part in re.split(r"^\$ ", text, flags=re.M)[1:]:
        command, _, expected = part.partition("\n")
        count += 1
        said = run(command, folder).stdout.strip()
        # Brackets are no pattern here.
        pattern = re.sub(r"([\[?*])", r"[\1]", expected.strip()).replace("…", "*")
        if not fnmatch.fnmatchcase(said, pattern):
            wrong.append(f"{command}\n    printed: {said}\n    not: {expected.strip()}")
    return count, wrong


def try_page(page):
    """How many commands it has that ran, and what went wrong."""
    count, left_out, wrong = 0, [], []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name in ("models", "docs"):
            shutil.copytree(ROOT / name, folder / name)
        for info, text in FENCE.findall(page.read_text()):
            kind, *words = info.split() or [""]
            if kind not in ("sh", "console") or words[:1] in (["clone"], ["farm"], ["gallery"]):
                continue
            missing = [p for p in words[1:] if words[0] == "needs" and not is_there(p)]
            if missing:
                left_out.append(", ".join(missing))
                continue
            ran, failures = (script if kind == "sh" else session)(text, folder)
            count, wrong = count + ran, wrong + failures
    told = f"; left out for want of {'; '.join(left_out)}" if left_out else ""
    if count or left_out:
        print(f"{page.relative_to(ROOT)}: {count} commands{told}", *wrong, sep="\n  ", flush=True)
    return count, [f"{page.relative_to(ROOT)}: {w}" for w in wrong]


def anchors(page):
    """Headings as pages link to them."""
    text = FENCE.sub("", page.read_text())
    plain = [re.sub(r"[^\w\- ]", "", h.lower()).strip().replace(" ", "-") for h in re.findall(r"^#+ (.*)$", text, re.M)]
    return set(plain) | set(re.findall(r'id="([^"]+)"', text))


def links(page):
    count, wrong = 0, []
    for target in LINK.findall(FENCE.sub("", page.read_text())):
        if re.match(r"[a-z]+:", target):
            continue
        count += 1
        path, _, anchor = unquote(target).partition("#")
        file = (page.parent / path).resolve() if path else page
        if not file.exists() or not file.is_relative_to(ROOT):
            wrong.append(f"{page.relative_to(ROOT)}: {target} leads nowhere")
        elif anchor and file.suffix == ".md" and anchor not in anchors(file):
            wrong.append(f"{page.relative_to(ROOT)}: {target}: there is no such heading")
    return count, wrong


def main():
    blinn = Path(sys.argv[1]).resolve()
    assert blinn.name == "blinn", "the program is found by its name"
    os.environ["PATH"] = f"{blinn.parent}{os.pathsep}{os.environ['PATH']}"
    chosen = [Path(p).resolve() for p in sys.argv[2:]] or pages()
    found = [links(page) for page in chosen]
    ran = [try_page(page) for page in chosen]
    wrong = [w for _, failures in found + ran for w in failures]
    print(f"{sum(n for n, _ in ran)} commands and {sum(n for n, _ in found)} links of {len(chosen)} pages")
    if not sys.argv[2:]:
        assert sum(n for n, _ in ran) > 40 and sum(n for n, _ in found) > 60, "pages were not read as they are written"
    if wrong:
        sys.exit("\n".join(wrong))


if __name__ == "__main__":
    main()
