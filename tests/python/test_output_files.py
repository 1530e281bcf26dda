"""Names and folders of the files that the command writes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import blinn


def render(folder: Path, scene: Path, *args: object) -> subprocess.CompletedProcess[str]:
    """Runs the command of the package, or the program BLINN_COMMAND, in a folder."""
    program = os.environ.get("BLINN_COMMAND")
    command = [program] if program else [sys.executable, "-m", "blinn"]
    arguments = ["render", str(scene), "--max-size", "16", "-s", "1", *map(str, args)]
    return subprocess.run([*command, *arguments], cwd=folder, capture_output=True, text=True)


@pytest.mark.parametrize("name", [".gnome_desktop_thumbnail.X3KQ81", "thumb", "thumb.2024-01-01", "a.b/ünï"])
def test_an_empty_file_of_any_name_becomes_a_thumbnail(models: Path, tmp_path: Path, name: str) -> None:
    (tmp_path / "a.b").mkdir()
    (tmp_path / name).touch()
    run = render(tmp_path, models / "tests/cube.obj", "-o", name)
    assert run.returncode == 0, run.stderr
    assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def test_files_without_a_known_ending_are_not_overwritten(models: Path, tmp_path: Path) -> None:
    (tmp_path / "notes").write_text("kept")
    run = render(tmp_path, models / "tests/cube.obj", "-o", "notes")
    assert run.returncode == 2 and "unknown format" in run.stderr
    assert (tmp_path / "notes").read_text() == "kept"


@pytest.mark.parametrize("name", ["train/000001/rgb/######.png", "test/000007/rgb/######.jpg"])
def test_folders_of_pictures_of_bop_hold_nothing_else(quad: blinn.Scene, tmp_path: Path, name: str) -> None:
    blinn.write_dataset(quad, tmp_path, views=2, formats="bop", layers=["albedo", "uv"], name=name, size=16, samples=1)
    rgb = (tmp_path / name).parent
    assert sorted(path.stem for path in rgb.iterdir()) == ["000001", "000002"]
    assert {path.suffix for path in rgb.iterdir()} == {Path(name).suffix}
    layers = {path.name for path in (rgb.parent / "layers").iterdir()}
    assert {"000001.albedo.png", "000002.uv.png", "000002.normal.png"} <= layers
