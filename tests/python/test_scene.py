"""Loading, inspecting and building scenes."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import blinn
from conftest import QUAD


def test_a_file_and_its_bytes_are_the_same_scene(models: Path) -> None:
    path = models / "cornell/cornell.glb"
    file, data = blinn.load(str(path)), blinn.load(path.read_bytes())
    assert file.triangle_count == data.triangle_count > 0
    np.testing.assert_array_equal(file.render(size=(32, 24)).rgba, data.render(size=(32, 24)).rgba)


def test_contents_are_listed(models: Path) -> None:
    scene = blinn.load(models / "figure/figure.glb")
    assert scene.bounds.shape == (2, 3) and (scene.bounds[1] > scene.bounds[0]).all()
    assert scene.objects and scene.materials and scene.duration > 0
    assert scene.animations[0]["seconds"] == scene.duration
    assert scene.info["triangles"] == scene.triangle_count
    for camera in scene.cameras:
        assert camera.camera_to_world.shape == (4, 4)


def test_errors_are_exceptions(tmp_path: Path, models: Path) -> None:
    with pytest.raises(FileNotFoundError):
        blinn.load(tmp_path / "missing.glb")
    with pytest.raises(blinn.LoadError, match="bytes"):
        blinn.load(b"glTF")
    with pytest.raises(blinn.LimitError):
        blinn.load(models / "tower/tower.glb", max_memory=1000)
    with pytest.raises(TypeError, match="sampels"):
        blinn.load(models / "lecture/lecture.obj").render(sampels=3)
    with pytest.raises(TypeError, match="render"):
        blinn.load(models / "lecture/lecture.obj", ao=3)
    with pytest.raises(ValueError, match="--exposure"):
        blinn.load(models / "lecture/lecture.obj").render(exposure="bright")
    with pytest.raises(TypeError):
        blinn.load(12)


def test_warnings_are_issued_and_listed(tmp_path: Path) -> None:
    scene = tmp_path / "scene.obj"
    scene.write_text("mtllib missing.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.warns(blinn.SceneWarning, match="missing.mtl"):
        loaded = blinn.load(scene)
    assert any("missing.mtl" in text for text in loaded.warnings)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(blinn.SceneWarning):
            blinn.load(scene)


def test_arrays_have_bounds_colors_and_instances() -> None:
    shift = np.eye(4)
    shift[:3, 3] = (5, 0, 0)
    scene = blinn.Scene.from_arrays(**QUAD, transforms=[np.eye(4), shift])
    np.testing.assert_allclose(scene.bounds, [[-1, -1, 0], [6, 1, 0]])
    assert scene.triangle_count == 4
    red = blinn.Scene.from_arrays(**QUAD, material={"base_color": (1, 0, 0), "name": "red"})
    albedo = red.render(size=(9, 9), layers=["albedo"])["albedo"]
    np.testing.assert_array_equal(albedo[4, 4], [1, 0, 0])
    assert red.materials[0]["name"] == "red"


def test_textures_are_upright() -> None:
    image = np.zeros((2, 2, 3), np.uint8)
    image[0] = 255
    uvs = [[0, 0], [1, 0], [1, 1], [0, 1]]
    scene = blinn.Scene.from_arrays(**QUAD, uvs=uvs, material={"base_color": (1, 1, 1), "base_color_texture": image})
    camera = blinn.Camera.look_at((0, 0, 3), (0, 0, 0))
    albedo = scene.render(camera, size=(33, 33), layers=["albedo"])["albedo"]
    assert albedo[10, 16].min() > 0.9 and albedo[22, 16].max() < 0.1


def test_wrong_arrays_are_explained() -> None:
    with pytest.raises(ValueError, match="shape"):
        blinn.Scene.from_arrays([[0, 0]], [[0, 0, 0]])
    with pytest.raises(ValueError, match="indices"):
        blinn.Scene.from_arrays(QUAD["vertices"], [[0, 1, 9]])
    with pytest.raises(ValueError, match="normals"):
        blinn.Scene.from_arrays(**QUAD, normals=[[0, 0, 1]])
    with pytest.raises(ValueError, match="colour"):
        blinn.Scene.from_arrays(**QUAD, material={"colour": 1})


def test_trimesh_round_trips() -> None:
    trimesh = pytest.importorskip("trimesh")
    box = blinn.Scene.from_trimesh(trimesh.creation.box(extents=(1, 2, 3)))
    np.testing.assert_allclose(box.bounds, [[-0.5, -1, -1.5], [0.5, 1, 1.5]])
    assert box.triangle_count == 12
    sphere = trimesh.creation.icosphere(subdivisions=3)
    assert blinn.Scene.from_trimesh(sphere).triangle_count == len(sphere.faces)
