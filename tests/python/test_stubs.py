"""Stubs, docstrings and the command."""

import doctest
import subprocess
import sys
from pathlib import Path

import pytest

import blinn


def test_docstring_examples_run() -> None:
    for module in (blinn, sys.modules["blinn._scene"]):
        failures, count = doctest.testmod(module)
        assert failures == 0 and count > 4


def test_the_command_runs() -> None:
    out = subprocess.run([sys.executable, "-m", "blinn", "--version"], capture_output=True, text=True, check=True)
    assert out.stdout.split() == ["blinn", blinn.__version__]
    wrong = subprocess.run([sys.executable, "-m", "blinn", "rendr"], capture_output=True, text=True)
    assert wrong.returncode == 2 and "rendr" in wrong.stderr


def test_stubs_pass_mypy_strict(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    example = tmp_path / "example.py"
    example.write_text(
        "import blinn\n"
        'scene = blinn.load("a.glb", up="z")\n'
        'picture = scene.render(size=(4, 3), layers=["depth"], exposure=0)\n'
        'depth = picture["depth"]\n'
        "hits = scene.intersect([[0, 0, 0]], [[0, 0, 1]])\n"
        "print(depth.shape, hits.t.sum(), picture.rgba.max())\n"
    )
    for target in [["-p", "blinn"], [str(example)]]:
        result = subprocess.run([sys.executable, "-m", "mypy", "--strict", *target], capture_output=True, text=True)
        assert result.returncode == 0, result.stdout


def test_every_public_name_has_documentation() -> None:
    for name in blinn.__all__:
        item = getattr(blinn, name)
        if not isinstance(item, str):
            assert (item.__doc__ or "").strip(), name
