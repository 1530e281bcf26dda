"""Messages about arrays and lists of cameras name arguments and files as the user knows them."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import blinn
from conftest import QUAD


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"uvs": np.full((4, 2), math.nan)}, "uvs of meshes[0]: 4 texture coordinates are not finite"),
        ({"colors": np.full((4, 3), math.inf)}, "colors of meshes[0]: 4 colours have non-finite"),
        ({"material": {"metallic": 3}}, "metallic of materials[0]: ignored value 3"),
        ({"material": {"ior": 0.5}}, "ior of materials[0]: ignored value 0.5"),
        ({"material": {"alpha_mode": "foo"}}, "alpha_mode of materials[0]: ignored invalid value 'FOO'"),
        ({"transforms": np.diag([1e39, 1, 1, 1])}, "transforms of nodes[0]: "),
    ],
)
def test_warnings_name_arguments(arguments: dict[str, Any], message: str) -> None:
    with pytest.warns(blinn.SceneWarning) as caught:
        scene = blinn.Scene.from_arrays(**QUAD, **arguments)
    assert [warning.filename for warning in caught] == [__file__]
    assert scene.warnings[0].startswith(message)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"uvs": np.zeros((3, 2))}, r"uvs must have shape \(4, 2\), not \(3, 2\)"),
        ({"transforms": np.eye(4)[:3]}, r"transforms must have shape .* not \(3, 4\)"),
        ({"transforms": np.eye(4) * math.nan}, "transforms must be finite"),
        ({"material": {"normal_texture": np.zeros((4, 4), np.float32)}}, "images must be uint8 or uint16"),
    ],
)
def test_errors_name_arguments(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        blinn.Scene.from_arrays(**QUAD, **arguments)


def test_matrices_with_nan_are_not_called_transposed() -> None:
    with pytest.raises(ValueError, match="not finite"):
        blinn.Camera.from_matrix(np.eye(4) * math.nan)


def test_errors_of_camera_lists_name_their_file_once(tmp_path: Path) -> None:
    path = tmp_path / "transforms.json"
    path.write_text(json.dumps({"w": 32, "h": 16, "fl_x": 20, "frames": [{"transform_matrix": [[1, 0], [0, 1]]}]}))
    with pytest.raises(blinn.LoadError, match="frames") as caught:
        blinn.load_cameras(path)
    assert str(caught.value).count("transforms.json") == 1
