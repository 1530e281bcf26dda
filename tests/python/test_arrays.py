"""Arrays as NumPy and trimesh hold them, and lists of cameras as COLMAP writes them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import blinn
from conftest import QUAD

CAMERA = blinn.Camera.look_at((0, 0, 3), (0, 0, 0), yfov=40)
UVS = [[0, 0], [1, 0], [1, 1], [0, 1]]
HALF = ((0.5 + 0.055) / 1.055) ** 2.4


def albedo(scene: blinn.Scene, layer: str = "albedo") -> np.ndarray:
    return scene.render(CAMERA, size=(8, 8), samples=1, layers=layer)[layer][4, 4]


@pytest.mark.parametrize("dtype", ["<u2", ">u2"])
def test_16_bits_may_be_in_any_byte_order(dtype: str) -> None:
    colors = np.full((4, 3), 32768, dtype)
    np.testing.assert_allclose(albedo(blinn.Scene.from_arrays(**QUAD, colors=colors)), HALF, atol=1e-3)
    for shape in ((4, 4, 3), (4, 4)):
        material = {"base_color_texture": np.full(shape, 32768, dtype)}
        np.testing.assert_allclose(albedo(blinn.Scene.from_arrays(**QUAD, uvs=UVS, material=material)), HALF, atol=1e-3)


def test_views_of_images_are_read_by_their_strides() -> None:
    image = np.zeros((4, 8, 3), np.uint8)
    image[:2, ::2] = 255
    for view in (image[::-1, ::2], np.asfortranarray(image[::-1, ::2])):
        scene = blinn.Scene.from_arrays(**QUAD, uvs=UVS, material={"base_color_texture": view})
        shown = scene.render(CAMERA, size=(8, 8), samples=1, layers="albedo")["albedo"]
        assert shown[2, 4].tolist() == [0, 0, 0] and shown[5, 4].tolist() == [1, 1, 1]


def test_floats_of_16_bits_are_linear() -> None:
    colors = np.full((4, 3), 0.5, np.float16)
    np.testing.assert_allclose(albedo(blinn.Scene.from_arrays(**QUAD, colors=colors)), 0.5, atol=1e-3)


def test_16_bits_of_ply_are_displayed_values(tmp_path: Path) -> None:
    properties = "".join(f"property float {axis}\n" for axis in "xyz") + "".join(
        f"property ushort {channel}\n" for channel in ("red", "green", "blue")
    )
    vertices = "".join(f"{x} {y} {z} 32768 65535 0\n" for x, y, z in QUAD["vertices"])
    header = f"ply\nformat ascii 1.0\nelement vertex 4\n{properties}element face 1\nproperty list uchar int vertex_indices\n"
    (tmp_path / "a.ply").write_text(f"{header}end_header\n{vertices}4 0 1 2 3\n")
    np.testing.assert_allclose(albedo(blinn.load(tmp_path / "a.ply", up="y")), [HALF, 1, 0], atol=1e-3)


def test_emission_may_exceed_1() -> None:
    for emissive in ((0.5, 0.25, 0), (4, 2, 0.8), (50, 0, 0), (300, 300, 300)):
        scene = blinn.Scene.from_arrays(**QUAD, material={"emissive": emissive})
        assert scene.warnings == []
        np.testing.assert_allclose(albedo(scene, "emission"), emissive, rtol=1e-5)


def trimesh_texture(trimesh: Any, **material: Any) -> np.ndarray:
    """Albedo of a square with a white texture."""
    image = pytest.importorskip("PIL.Image").new("RGB", (4, 4), "white")
    materials = trimesh.visual.material
    if "baseColorFactor" in material:
        made = materials.PBRMaterial(baseColorTexture=image, **material)
    else:
        made = materials.SimpleMaterial(image=image, **material)
    visual = trimesh.visual.TextureVisuals(uv=np.array(UVS, float), material=made)
    return albedo(blinn.Scene.from_trimesh(trimesh.Trimesh(**QUAD, process=False, visual=visual)))


def test_trimesh_textures_are_multiplied_by_given_factors_only() -> None:
    trimesh = pytest.importorskip("trimesh")
    assert trimesh_texture(trimesh).tolist() == [1, 1, 1]
    np.testing.assert_allclose(trimesh_texture(trimesh, diffuse=[51, 51, 51, 255]), 0.2, atol=1e-3)
    np.testing.assert_allclose(trimesh_texture(trimesh, baseColorFactor=[102, 102, 102, 255]), 0.4, atol=1e-3)
    np.testing.assert_allclose(trimesh_texture(trimesh, baseColorFactor=None), 1)


@pytest.mark.parametrize("dtype", ["<u2", ">u2", "int32", "float32"])
def test_trimesh_images_of_more_than_8_bits_are_not_cut_off(dtype: str) -> None:
    trimesh, pil = pytest.importorskip("trimesh"), pytest.importorskip("PIL.Image")
    if dtype == ">u2":
        image = pil.frombytes("I;16B", (4, 4), b"\x80\x00" * 16)
    else:
        image = pil.fromarray(np.full((4, 4), 0.5 if dtype == "float32" else 32768, dtype))
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=image)
    visual = trimesh.visual.TextureVisuals(uv=np.array(UVS, float), material=material)
    scene = blinn.Scene.from_trimesh(trimesh.Trimesh(**QUAD, process=False, visual=visual))
    np.testing.assert_allclose(albedo(scene), HALF, atol=1e-3)


def test_other_objects_than_trimesh_are_refused() -> None:
    with pytest.raises(TypeError, match="not list"):
        blinn.Scene.from_trimesh([])


def test_trimesh_faces_are_translucent_one_by_one() -> None:
    trimesh = pytest.importorskip("trimesh")
    square = trimesh.Trimesh(**QUAD, process=False)
    square.visual.face_colors = [[255, 0, 0, 51], [0, 0, 255, 255]]
    shown = blinn.Scene.from_trimesh(square).render(CAMERA, size=(16, 16), samples=1, background="transparent").rgba
    # The first face is on the lower right of the diagonal.
    assert shown[10, 9, 3] == 51 and shown[6, 6, 3] == 255


@pytest.mark.parametrize(
    "change",
    [
        lambda mesh: mesh.apply_translation([500000.37, 4500000.13, 300]),
        lambda mesh: mesh.apply_translation([1e7, 0, 0]),
        lambda mesh: mesh.apply_scale(1e-3),
        lambda mesh: mesh.apply_transform(np.diag([-1, 1, 1, 1])),
        lambda mesh: mesh.invert(),
        lambda mesh: mesh.copy(include_cache=True),
    ],
    ids=["far", "farther", "scaled", "mirrored", "inverted", "copied"],
)
def test_normals_that_trimesh_computed_before_a_change_do_not_count(change: Any) -> None:
    trimesh = pytest.importorskip("trimesh")

    def normals(*, are_read: bool, are_given: bool = False) -> int:
        mesh = trimesh.creation.icosphere(subdivisions=2)
        if are_read:
            assert len(mesh.vertex_normals)
        if are_given:
            mesh.vertex_normals = mesh.vertices.astype(np.float32)
        mesh = change(mesh) or mesh
        middle, above = mesh.bounds.mean(0), np.array([0, 0, 3 * mesh.scale])
        camera = blinn.Camera.look_at(middle + above, middle, yfov=30)
        shown = blinn.Scene.from_trimesh(mesh).render(camera, size=(32, 32), samples=1, layers="normal")["normal"]
        return len(np.unique(shown.reshape(-1, 3).round(3), axis=0))

    assert normals(are_read=True) == normals(are_read=False) < normals(are_read=False, are_given=True)


POSE = "0.9238795325112867 0 0.3826834323650898 0 .1 .2 3"


@pytest.mark.parametrize(
    ("lines", "count"),
    [
        (["1 {} 1 a.png", "2 {} 1 b.png", "3 {} 1 c.png"], 3),
        (["1 {} 1 0001", "2 {} 1 0002"], 2),
        (["# points on some lines", "1 {} 1 a", "", "2 {} 1 b", "3 {} 1 c", "1 2 -1", "4 {} 1 d e f", "# end"], 4),
        (["1 {} 1 a", "", "", "2 {} 1 b", "  ", "3 {} 1 c"], 3),
    ],
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_colmap_images_may_lack_lines_of_points(tmp_path: Path, lines: list[str], count: int, end: str) -> None:
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 32 16 20 20 16 8")
    (tmp_path / "images.txt").write_text(end.join(line.format(POSE) for line in lines), newline="")
    cameras = blinn.load_cameras(tmp_path)
    assert len(cameras) == count
    np.testing.assert_allclose([camera.position for camera in cameras], [[2.0506, -0.2, -2.1920]] * count, atol=1e-4)
