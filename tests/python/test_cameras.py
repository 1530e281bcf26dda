"""Camera lists of other programs: the same camera in other words."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import blinn

POSE = np.array([[1.0, 0, 0, 0.25], [0, 1, 0, -0.5], [0, 0, 1, 4], [0, 0, 0, 1]])
FOCAL = 8 / math.tan(0.2)
K = [[FOCAL, 0, 16], [0, FOCAL, 8], [0, 0, 1]]
LENS = {"camera_angle_x": 2 * math.atan(16 / FOCAL)}


def load(folder: Path, pose: Any = POSE, lens: dict[str, Any] = LENS, **frame: Any) -> blinn.Camera:
    """Loads the only frame of a list, which is 32 x 16 pixels."""
    frame = {"file_path": "a", "transform_matrix": np.asarray(pose).tolist(), **frame}
    path = folder / "transforms.json"
    path.write_text(json.dumps({"w": 32, "h": 16, **lens, "frames": [frame]}))
    (camera,) = blinn.load_cameras(path)
    return camera


@pytest.mark.parametrize(
    "lens", [LENS, {"camera_angle_y": 0.4}, {"fl_y": FOCAL}, {**LENS, "sharpness": math.nan}]
)
def test_lenses_are_the_same_in_other_words(tmp_path: Path, lens: dict[str, Any]) -> None:
    np.testing.assert_allclose(load(tmp_path, lens=lens).intrinsics(), K, rtol=1e-5, atol=1e-5)


def test_lenses_of_frames_replace_the_common_one(tmp_path: Path) -> None:
    camera = load(tmp_path, lens={"fl_x": 9}, fl_x=FOCAL, fl_y=FOCAL)
    np.testing.assert_allclose(camera.intrinsics(), K, rtol=1e-5, atol=1e-5)


def test_scale_and_rounding_of_poses_do_not_count(tmp_path: Path, quad: blinn.Scene) -> None:
    expected = quad.render(load(tmp_path)).rgba
    assert len(np.unique(expected)) > 2
    scaled, rounded = POSE.copy(), POSE.copy()
    scaled[:3, :3] *= 2
    rounded[3, 1] = 1e-14
    for pose in (scaled, rounded):
        np.testing.assert_array_equal(quad.render(load(tmp_path, pose)).rgba, expected)


@pytest.mark.parametrize(("pose", "message"), [(POSE.T, "transposed"), (POSE * math.nan, "finite")])
def test_wrong_poses_are_explained(tmp_path: Path, pose: Any, message: str) -> None:
    with pytest.raises(blinn.LoadError, match=message):
        load(tmp_path, pose)


def test_messages_name_the_list_once(tmp_path: Path) -> None:
    path = tmp_path / "transforms.json"
    frames = [{"file_path": "a"}, {"file_path": "b", "transform_matrix": POSE.tolist()}]
    path.write_text(json.dumps({"w": 32, "h": 16, **LENS, "frames": frames}))
    with pytest.warns(blinn.SceneWarning) as warned:
        assert len(blinn.load_cameras(path)) == 1
    assert [str(w.message) for w in warned] == [f"{path}: left out 1 picture without a pose"]
    path.write_text("{}", encoding="utf-16")
    with pytest.raises(blinn.LoadError) as refused:
        blinn.load_cameras(path)
    assert str(refused.value).count(str(path)) == 1
