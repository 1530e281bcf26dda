"""Runs the commands of README and docs, and checks their links.

    python .ci/docs.py BLINN [PAGE…]

The blocks of each page run in order in a temporary folder that holds the models, with BLINN on the PATH:
- ```sh: run by bash; each line must succeed.
- ```console: `$ command` and its output, where … matches anything.
- ```sh needs NAME…: run only if these programs exist (`bpy` is a Python that has it).
- ```sh clone: not run; needs a clone, and .ci/run covers it.
- ```sh gallery: not run; docs/scripts/gallery.py runs them and writes the page.
- ```sh view: not run; runs until it is ended, and .ci/view.py runs similar commands.
- ```sh farm: not run; needs a farm, and .ci/farm.py runs similar commands.
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
# [text](target) and ![text](target); text may contain an image.
LINK = re.compile(r"\]\(\s*<?([^()\s>]+)>?\s*\)")


def pages():
    top = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md", "models/README.md")]
    return top + sorted((ROOT / "docs").rglob("*.md"))


def exists(program):
    if program == "bpy":
        return subprocess.run(["python", "-c", "import bpy"], capture_output=True).returncode == 0
    return shutil.which(program) is not None


def run(command, folder):
    return subprocess.run(
        ["bash", "-euo", "pipefail", "-c", command], cwd=folder, stdin=subprocess.DEVNULL, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )


def commands(text):
    """Splits a block into commands, joining lines that end in a backslash; a block with a here-document is one command."""
    return [text] if "<<" in text else re.sub(r"\\\n", " ", text).splitlines()


def script(text, folder):
    failures, count = [], 0
    for command in commands(text):
        if command.strip() and not command.lstrip().startswith("#"):
            count += 1
            done = run(command, folder)
            if done.returncode:
                failures.append(f"{command}\n    exit code {done.returncode}: {done.stdout.strip()[-600:]}")
    return count, failures


def session(text, folder):
    failures, count = [], 0
    for part in re.split(r"^\$ ", text, flags=re.M)[1:]:
        command, _, expected = part.partition("\n")
        count += 1
        output = run(command, folder).stdout.strip()
        # Brackets are literal.
        pattern = re.sub(r"([\[?*])", r"[\1]", expected.strip()).replace("…", "*")
        if not fnmatch.fnmatchcase(output, pattern):
            failures.append(f"{command}\n    printed: {output}\n    expected: {expected.strip()}")
    return count, failures


def try_page(page):
    """Runs a page's commands; returns their count and the failures."""
    count, skipped, failures = 0, [], []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name in ("models", "docs"):
            shutil.copytree(ROOT / name, folder / name)
        for info, text in FENCE.findall(page.read_text()):
            kind, *words = info.split() or [""]
            if kind not in ("sh", "console") or words[:1] in (["clone"], ["farm"], ["gallery"], ["view"]):
                continue
            missing = [p for p in words[1:] if words[0] == "needs" and not exists(p)]
            if missing:
                skipped.append(", ".join(missing))
                continue
            ran, failed = (script if kind == "sh" else session)(text, folder)
            count += ran
            failures += failed
    note = f"; skipped blocks that need {'; '.join(skipped)}" if skipped else ""
    if count or skipped:
        print(f"{page.relative_to(ROOT)}: {count} commands{note}", *failures, sep="\n  ", flush=True)
    return count, [f"{page.relative_to(ROOT)}: {f}" for f in failures]


def anchors(page):
    """Returns the anchors of a page: its headings and ids."""
    text = FENCE.sub("", page.read_text())
    headings = [re.sub(r"[^\w\- ]", "", h.lower()).strip().replace(" ", "-") for h in re.findall(r"^#+ (.*)$", text, re.M)]
    return set(headings) | set(re.findall(r'id="([^"]+)"', text))


def links(page):
    """Checks a page's relative links; returns their count and the failures."""
    count, failures = 0, []
    for target in LINK.findall(FENCE.sub("", page.read_text())):
        if re.match(r"[a-z]+:", target):
            continue
        count += 1
        path, _, anchor = unquote(target).partition("#")
        file = (page.parent / path).resolve() if path else page
        if not file.exists() or not file.is_relative_to(ROOT):
            failures.append(f"{page.relative_to(ROOT)}: {target}: no such file")
        elif anchor and file.suffix == ".md" and anchor not in anchors(file):
            failures.append(f"{page.relative_to(ROOT)}: {target}: no such heading")
    return count, failures


def main():
    blinn = Path(sys.argv[1]).resolve()
    assert blinn.name == "blinn", "the executable must be called blinn, since commands find it by name"
    os.environ["PATH"] = f"{blinn.parent}{os.pathsep}{os.environ['PATH']}"
    chosen = [Path(p).resolve() for p in sys.argv[2:]] or pages()
    checked = [links(page) for page in chosen]
    ran = [try_page(page) for page in chosen]
    failures = [f for _, failed in checked + ran for f in failed]
    print(f"{sum(n for n, _ in ran)} commands and {sum(n for n, _ in checked)} links of {len(chosen)} pages")
    if not sys.argv[2:]:
        assert sum(n for n, _ in ran) > 40 and sum(n for n, _ in checked) > 60, "too few commands or links were found"
    if failures:
        sys.exit("\n".join(failures))


if __name__ == "__main__":
    main()
