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


def test_scenes_are_loaded_and_not_constructed(models: Path) -> None:
    with pytest.raises(TypeError, match=r"not made from str: use blinn\.load\(path"):
        blinn.Scene(str(models / "cornell/cornell.glb"))  # type: ignore[arg-type]


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
    np.testing.assert_allclose(albedo, [1, 0, 0], atol=1e-3)


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
        blinn.Scene.from_arrays(**QUAD, uvs=np.full((4, 2), np.nan))
        blinn.Scene.from_meshes([{**QUAD, "uvs": np.full((4, 2), np.nan)}])
    assert [warning.filename for warning in caught] == [__file__] * 3


def test_empty_arrays_are_an_empty_scene() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        empty = blinn.Scene.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
        assert empty.triangle_count == 0 and np.isnan(empty.bounds).all()
        assert empty.render(size=(4, 4), layers="mask")["mask"].max() == 0
        assert np.isinf(empty.intersect([[0, 0, 0]], [[0, 0, 1]]).t).all()


CAMERA = blinn.Camera.look_at((0, 0, 3), (0, 0, 0), yfov=40)
UVS = [[0, 0], [1, 0], [1, 1], [0, 1]]


def albedo(scene: blinn.Scene) -> np.ndarray:
    return scene.render(CAMERA, size=(8, 8), layers="albedo")["albedo"][4, 4]


@pytest.mark.parametrize("offset", [(500000.25, 4500000.5, 300.0), (500000.37, 4500000.13, -812.77)])
def test_arrays_far_from_the_origin_keep_their_shape(offset: tuple[float, ...]) -> None:
    rng = np.random.default_rng(3)
    vertices, faces = rng.normal(size=(60, 3)), rng.integers(0, 60, (100, 3))
    near = blinn.Scene.from_arrays(vertices, faces)
    place = np.eye(4)
    place[:3, 3] = offset
    far = [
        blinn.Scene.from_arrays(vertices + offset, faces),
        blinn.Scene.from_arrays(vertices, faces, transforms=place),
        blinn.Scene.from_arrays(vertices + 2 * np.array(offset), faces, transforms=np.linalg.inv(place)),
    ]
    origins, directions = rng.normal(size=(500, 3)) * 4, rng.normal(size=(500, 3))
    expected = near.intersect(origins, directions)
    for scene in far:
        np.testing.assert_allclose(scene.bounds - offset, near.bounds, atol=1e-5)
        hits = scene.intersect(origins + offset, directions)
        same = hits.triangle == expected.triangle
        assert same.mean() > 0.99
        np.testing.assert_allclose(hits.t[same], expected.t[same], rtol=1e-4)


def test_textures_and_colours_are_shown_as_they_are() -> None:
    white = np.full((4, 4, 3), 255, np.uint8)
    textured = {"base_color_texture": white}
    np.testing.assert_allclose(albedo(blinn.Scene.from_arrays(**QUAD, uvs=UVS, material=textured)), 1, atol=1e-3)
    np.testing.assert_allclose(albedo(blinn.Scene.from_arrays(**QUAD, colors=np.ones((4, 3)))), 1, atol=1e-3)
    dimmed = {"base_color": (0.5, 0.25, 1)}
    found = albedo(blinn.Scene.from_arrays(**QUAD, uvs=UVS, material={**textured, **dimmed}))
    np.testing.assert_allclose(found, [0.5, 0.25, 1], atol=1e-3)
    np.testing.assert_allclose(albedo(blinn.Scene.from_arrays(**QUAD)), 0.8, atol=1e-3)


def test_colours_have_8_or_16_bits() -> None:
    half = ((0.5 + 0.055) / 1.055) ** 2.4
    for dtype, value in [(np.uint8, 127.5), (np.uint16, 32767.5), (np.int64, 127.5)]:
        colors = np.full((4, 3), value).astype(dtype)
        np.testing.assert_allclose(albedo(blinn.Scene.from_arrays(**QUAD, colors=colors)), half, atol=5e-3)
    image = np.full((4, 4, 3), 32768, np.uint16)
    scene = blinn.Scene.from_arrays(**QUAD, uvs=UVS, material={"base_color_texture": image})
    np.testing.assert_allclose(albedo(scene), half, atol=5e-3)
    for wrong in (np.full((4, 3), 256), np.full((4, 3), -1), np.full((4, 3), True)):
        with pytest.raises(ValueError, match="colors"):
            blinn.Scene.from_arrays(**QUAD, colors=wrong)


def test_alpha_of_colours_and_textures_is_shown() -> None:
    def alpha(**more: object) -> int:
        scene = blinn.Scene.from_arrays(**QUAD, **more)
        return int(scene.render(CAMERA, size=(8, 8), background="transparent").rgba[4, 4, 3])

    half = np.array([[255, 0, 0, 128]] * 4, np.uint8)
    assert 120 < alpha(colors=half) < 136
    assert 120 < alpha(colors=half / 255) < 136
    image = np.full((4, 4, 4), 128, np.uint8)
    assert 120 < alpha(uvs=UVS, material={"base_color_texture": image}) < 136
    assert alpha(colors=half, material={"alpha_mode": "opaque"}) == 255


def test_transposed_matrices_are_refused() -> None:
    place = np.eye(4)
    place[:3, 3] = (1, 2, 3)
    with pytest.raises(ValueError, match="transposed"):
        blinn.Scene.from_arrays(**QUAD, transforms=place.T)
    with pytest.raises(ValueError, match="transposed"):
        blinn.Scene.from_arrays(**QUAD, transforms=[np.eye(4), place.T])
    with pytest.raises(ValueError, match="transposed"):
        blinn.Camera.from_matrix(place.T)
    rounded = place.copy()
    rounded[3] = [1e-17, 0, 0, 1 - 1e-16]
    assert blinn.Camera.from_matrix(rounded).position.tolist() == [1, 2, 3]
    assert blinn.Scene.from_arrays(**QUAD, transforms=rounded).bounds[0].tolist() == [0, 1, 3]
    scaled = place @ np.diag([0.1, 0.1, 0.1, 1])
    np.testing.assert_allclose(blinn.Camera.from_matrix(scaled).camera_to_world, place, atol=1e-12)
    with pytest.raises(ValueError, match="remove the scale"):
        blinn.Camera.from_matrix(place @ np.diag([1, 2, 1, 1]))
    K = np.array([[250, 3e-14, 160], [0, 250, 120], [0, 0, 1 - 1e-16]])
    assert blinn.Camera.from_intrinsics(K, [320, 240]).size == (320, 240)
    with pytest.raises(ValueError, match="skew"):
        blinn.Camera.from_intrinsics(K + [[0, 3, 0], [0, 0, 0], [0, 0, 0]], (320, 240))


def test_messages_are_about_arrays() -> None:
    vertices = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, np.nan]])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = blinn.Scene.from_arrays(vertices, QUAD["faces"])
        assert not any("JSON" in text for text in scene.warnings)
        assert scene.render(size=[8, 8], layers="mask")["mask"].any()
        assert scene.render(size=np.array([8, 8])).rgba.shape == (8, 8, 4)
    for size in ([8], (8, 8, 8), 8.5, -8, (8.5, 8), "8x8"):
        with pytest.raises(ValueError, match="size"):
            scene.render(size=size)
    for faces in ([[0, 1, 1.7]], [[0, 1, np.nan]], [[True, False, True]]):
        with pytest.raises(ValueError, match="faces must be integers"):
            blinn.Scene.from_arrays(vertices[:3], faces)
    assert blinn.Scene.from_arrays(vertices[:3], [[0.0, 1.0, 2.0]]).triangle_count == 1
    with pytest.raises(ValueError, match="base_color must be finite"):
        blinn.Scene.from_arrays(**QUAD, material={"base_color": (np.nan, 0, 0)})


def test_trimesh_faces_have_their_own_colours() -> None:
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box()
    corner = blinn.Camera.look_at((2, 1.6, 2.4), (0, 0, 0), yfov=35)
    palette = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0], [255, 0, 255], [0, 255, 255]], np.uint8)
    colors = palette[np.arange(12) // 2]
    box.visual.face_colors = np.c_[colors, np.full(12, 255, np.uint8)]
    visible = np.einsum("ij,ij->i", box.face_normals, corner.position - box.triangles_center) > 0
    expected = np.unique(colors[visible] // 255, axis=0)
    for source in (box, trimesh.Scene(box)):
        found = blinn.Scene.from_trimesh(source).render(corner, size=(64, 64), layers="albedo")["albedo"]
        np.testing.assert_array_equal(np.unique(found[found.sum(-1) > 0].round(2), axis=0), expected)
    half = trimesh.Trimesh(QUAD["vertices"], QUAD["faces"], process=False)
    half.visual.vertex_colors = np.array([[255, 0, 0, 128]] * 4, np.uint8)
    shown = blinn.Scene.from_trimesh(half).render(CAMERA, size=(8, 8), background="transparent")
    assert 120 < shown.rgba[4, 4, 3] < 136


def test_normals_that_trimesh_computes_do_not_count() -> None:
    trimesh = pytest.importorskip("trimesh")

    def normals(mesh: object) -> int:
        layer = blinn.Scene.from_trimesh(mesh).render(size=(48, 48), layers="normal")["normal"]
        return len(np.unique(layer.reshape(-1, 3).round(3), axis=0))

    fresh, read, turned, given = (trimesh.creation.icosphere(subdivisions=2) for _ in range(4))
    assert len(read.vertex_normals) == len(turned.vertex_normals)
    turned.apply_transform(trimesh.transformations.rotation_matrix(0.0, (0, 1, 0)))
    given.vertex_normals = given.vertices.astype(np.float32)
    assert normals(fresh) == normals(read) == normals(turned) < normals(given)


def test_trimesh_scenes_far_away_keep_their_shape() -> None:
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(subdivisions=3)
    offset = np.array([500000.37, 4500000.13, 300])
    scene = trimesh.Scene(ball)
    scene.apply_translation(offset)
    for source in (scene, ball.copy().apply_translation(offset)):
        loaded = blinn.Scene.from_trimesh(source)
        np.testing.assert_allclose(loaded.bounds - offset, ball.bounds, atol=1e-6)


def test_transforms_bring_arrays_back_from_far_away() -> None:
    offset = np.array([4e6 + 0.25, 5e6, 0])
    back = np.eye(4)
    back[:3, 3] = -offset
    vertices = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0]]) + offset
    scene = blinn.Scene.from_arrays(vertices, [[0, 1, 2]], transforms=back)
    np.testing.assert_array_equal(scene.bounds, [[-1, -1, 0], [1, 1, 0]])
