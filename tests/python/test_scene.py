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
    with pytest.raises(ValueError, match="for exposure: "):
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
    image = np.zeros((8, 8, 3), np.uint8)
    image[:4] = 255
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


def test_trimesh_keeps_textures_and_instances() -> None:
    trimesh = pytest.importorskip("trimesh")
    image = pytest.importorskip("PIL.Image").fromarray(np.full((4, 4, 3), (255, 0, 0), np.uint8))
    visual = trimesh.visual.TextureVisuals(uv=[[0, 0], [1, 0], [1, 1], [0, 1]], image=image)
    mesh = trimesh.Trimesh(QUAD["vertices"], QUAD["faces"], visual=visual, process=False)
    scene = trimesh.Scene(mesh)
    scene.add_geometry(mesh, transform=trimesh.transformations.translation_matrix([3, 0, 0]))
    loaded = blinn.Scene.from_trimesh(scene)
    np.testing.assert_allclose(loaded.bounds, [[-1, -1, 0], [4, 1, 0]])
    camera = blinn.Camera.look_at((0, 0, 3), (0, 0, 0))
    albedo = loaded.render(camera, size=(9, 9), layers="albedo")["albedo"][4, 4]
    assert albedo[0] > 0.3 and albedo[1] == albedo[2] == 0


def test_a_glb_of_trimesh_is_the_same_scene(tmp_path: Path, models: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    file = models / "textured/textured.glb"
    loaded = blinn.Scene.from_trimesh(trimesh.load(file))
    original = blinn.load(file)
    np.testing.assert_allclose(loaded.bounds, original.bounds, atol=1e-5)
    camera = blinn.Camera.look_at(original.bounds[1] * 3 + 1, original.bounds.mean(axis=0))
    a, b = (scene.render(camera, size=(48, 48), layers="mask")["mask"] for scene in (loaded, original))
    assert (a != b).mean() < 0.01 and a.any()


def test_sequences_are_values_of_options(quad: blinn.Scene) -> None:
    camera = blinn.Camera.look_at((0, 0, 3), (0, 0, 0))

    def render(**options: object) -> np.ndarray:
        return quad.render(camera, size=(8, 8), **options).rgba

    one = render(sun=(0, 0, -1, 1))
    np.testing.assert_array_equal(one, render(sun="0,0,-1,1"))
    np.testing.assert_array_equal(one, render(sun=[np.array([0, 0, -1, 1])]))
    np.testing.assert_array_equal(render(sun=[(0, 0, -1, 0.5), (0, 0, -1, 0.5)]).max(), one.max())
    np.testing.assert_array_equal(render(lights=["headlight", "three-point"]), render(lights="headlight,three-point"))
    np.testing.assert_array_equal(render(no_shadows=False), render(no_shadows=None))


def test_culling_does_not_change_the_scene(quad: blinn.Scene) -> None:
    behind = blinn.Camera.look_at((0, 0, -3), (0, 0, 0))

    def coverage(**options: object) -> float:
        return float(quad.render(behind, size=(9, 9), layers="mask", **options)["mask"].mean())

    assert coverage() > 0
    with pytest.warns(blinn.SceneWarning, match="back faces"):
        assert coverage(cull="back") == 0
    assert coverage() > 0


def test_warnings_name_the_line_of_the_caller(tmp_path: Path) -> None:
    scene = tmp_path / "scene.obj"
    scene.write_text("mtllib missing.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        blinn.load(scene)
    assert caught[0].filename == __file__


def test_empty_arrays_are_an_empty_scene() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        empty = blinn.Scene.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
        assert empty.triangle_count == 0 and np.isnan(empty.bounds).all()
        assert empty.render(size=(4, 4), layers="mask")["mask"].max() == 0
        assert np.isinf(empty.intersect([[0, 0, 0]], [[0, 0, 1]]).t).all()
