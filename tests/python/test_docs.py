"""The code of the documentation runs, and its examples are typed."""

import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "docs/examples/python"


def test_the_tutorial_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "models").symlink_to(ROOT / "models")
    blocks = re.findall(r"^```python\n(.*?)^```$", (ROOT / "docs/tutorial/python.md").read_text(), re.S | re.M)
    assert len(blocks) > 6
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "python.md", "exec"), names)
    assert len(list(tmp_path.glob("view_?.png"))) == 8
    depth = np.load(tmp_path / "view_0.npy")
    assert depth.shape == (128, 128) and np.isfinite(depth).any()


def test_the_example_of_views_runs(tmp_path: Path) -> None:
    command = [sys.executable, EXAMPLES / "views.py", ROOT / "models/tower/tower.glb", tmp_path / "views", "3"]
    subprocess.run(command, check=True)
    assert len(list((tmp_path / "views").glob("????.png"))) == 3
    depth = np.load(tmp_path / "views/0002.npy")
    assert depth.dtype == np.float32 and np.isfinite(depth).any()


def test_the_example_of_a_data_set_reads_a_folder(tmp_path: Path) -> None:
    shutil.copy(ROOT / "models/tower/tower.glb", tmp_path / "a.glb")
    (tmp_path / "b.glb").write_bytes(b"glTF, cut off")
    views = runpy.run_path(str(EXAMPLES / "dataloader.py"))["Views"](tmp_path, views=2)
    assert len(views) == 4
    assert views[0]["image"].shape == (3, 128, 128) and views[0]["image"].dtype == np.float32
    assert not np.array_equal(views[0]["image"], views[1]["image"])
    assert views[0]["depth"].max() > 0 and views[3]["depth"].max() == 0
    with pytest.raises(IndexError):
        views[4]


@pytest.mark.parametrize("name", ["views.py", "dataloader.py"])
def test_examples_pass_mypy_strict(name: str) -> None:
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", str(EXAMPLES / name)]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout
