"""Scenes in other processes."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import blinn


def test_scenes_of_files_are_pickled_by_path(models: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(models)
    scene = blinn.load("figure/figure.glb", hide=None).pose(0.5, animation=0)
    data = pickle.dumps(scene)
    assert len(data) < 1000
    # Another folder does not matter.
    monkeypatch.chdir(tmp_path)
    other = pickle.loads(data)
    assert other.time == 0.5 and (other.render(size=32).rgba == scene.render(size=32).rgba).all()


def test_scenes_of_arrays_and_bytes_are_pickled_with_their_data(quad: blinn.Scene, models: Path) -> None:
    content = (models / "tests/cube.obj").read_bytes()
    for scene in [quad, blinn.load(content, scale=2)]:
        other = pickle.loads(pickle.dumps(scene))
        assert np.array_equal(other.bounds, scene.bounds) and repr(other) == repr(scene)


def test_workers_render_pickled_scenes(quad: blinn.Scene, tmp_path: Path) -> None:
    (tmp_path / "scene.pickle").write_bytes(pickle.dumps(quad))
    code = "import pickle; print(pickle.load(open('scene.pickle', 'rb')).render(size=16).rgba.sum())"
    out = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert int(out.stdout) == quad.render(size=16).rgba.sum()


def test_a_lost_file_is_reported(tmp_path: Path, models: Path) -> None:
    copy = tmp_path / "cube.obj"
    copy.write_bytes((models / "tests/cube.obj").read_bytes())
    data = pickle.dumps(blinn.load(copy))
    os.remove(copy)
    with pytest.raises(FileNotFoundError, match="cube.obj"):
        pickle.loads(data)
