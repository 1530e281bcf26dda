"""The types of options in `blinn/_options.py`."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import blinn
from blinn import _blinn

SOURCE = Path(__file__).resolve().parents[2] / "src/python/blinn/_options.py"


def test_the_types_are_those_of_the_table() -> None:
    """`GOLDEN=update` rewrites them."""
    if os.environ.get("GOLDEN") == "update":
        SOURCE.write_text(_blinn.option_types())
    assert SOURCE.read_text() == _blinn.option_types(), "rewrite it with GOLDEN=update just pytest -k test_options"


def test_the_types_have_all_options() -> None:
    from blinn._options import LoadOptions, RenderOptions

    parameters = {"size", "samples"}
    assert sorted({*RenderOptions.__annotations__, *parameters}) == blinn.render_options()
    assert {"format", "hide", "max_memory", "up"} <= set(LoadOptions.__annotations__)


def test_type_checkers_know_options(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    lines = [
        ('scene.render(sun=[(0, -1, 0, 2), (1, -1, 0, 2)], point_light="0,1,0,5", ao=16, background="transparent", view="agx")', ""),
        ("scene.render(size=256, exposure=-1.5, no_shadows=True, clip=None, orbit=(30, 20))", ""),
        ('blinn.load("a.glb", hide=["wheel*"], up="z")', ""),
        ("scene.render(exposuer=0)", "exposuer"),
        ('scene.render(view="agX")', "view"),
        ('blinn.load("a.glb", up="w")', "up"),
        ("scene.render(ambient={})", "ambient"),
    ]
    example = tmp_path / "example.py"
    example.write_text("import blinn\nscene = blinn.load('a.glb')\n" + "".join(f"{line}\n" for line, _ in lines))
    command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", str(example)]
    found = subprocess.run(command, capture_output=True, text=True).stdout.splitlines()
    for i, (line, word) in enumerate(lines):
        here = [error for error in found if f"example.py:{i + 3}:" in error]
        assert bool(here) == bool(word) and word in "".join(here), (line, found)
