"""Light with a known answer: environments, coloured reflections, and colours that no light reaches."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import blinn
from gltf_file import SQUARE, Glb

CAMERA = blinn.Camera.look_at((0, 0, 5), (0, 0, 0), yfov=30)
RAW: dict[str, Any] = {"exposure": 0, "view": "raw", "samples": 1}
UNLIT = {"KHR_materials_unlit": {}}
FACING = np.float32([[0, 0, 1]] * 4)


def save_hdr(path: Path, pixels: np.ndarray) -> Path:
    """Writes a Radiance picture without compression."""
    brightest = pixels.max(-1)
    exponent = np.floor(np.log2(brightest)) + 1
    mantissa = pixels * (256 / 2.0**exponent)[..., None]
    rgbe = np.concatenate([mantissa, exponent[..., None] + 128], -1).astype(np.uint8)
    height, width = brightest.shape
    path.write_bytes(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode() + rgbe.tobytes())
    return path


def sun(width: int, row: int, column: int) -> tuple[np.ndarray, np.ndarray]:
    """A panorama of 0.2 with one texel that adds an irradiance of 4 π, and the direction to it."""
    height = width // 2
    pixels = np.full((height, width, 3), 0.2)
    solid_angle = 2 * np.pi / width * (np.cos(row / height * np.pi) - np.cos((row + 1) / height * np.pi))
    pixels[row, column] += 4 * np.pi / solid_angle
    return pixels, direction((row + 0.5) / height * np.pi, ((column + 0.5) / width - 0.5) * 2 * np.pi)


def direction(down: float, around: float) -> np.ndarray:
    return np.array([np.sin(down) * np.cos(around), np.cos(down), np.sin(down) * np.sin(around)])


def white_ball() -> blinn.Scene:
    """A white ball that reflects diffusely only."""
    down, around = np.meshgrid(np.linspace(0, np.pi, 25), np.linspace(0, 2 * np.pi, 49), indexing="ij")
    vertices = np.moveaxis(direction(down, around), 0, -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(24), np.arange(48), indexing="ij")
    a = (i * 49 + j).ravel()
    faces = np.concatenate([np.c_[a, a + 1, a + 50], np.c_[a, a + 50, a + 49]])
    material = {"base_color": (1, 1, 1), "roughness": 1, "ior": 1}
    return blinn.Scene.from_arrays(vertices, faces, normals=vertices, material=material)


def shades(hdri: Path, eye: Any = (0, 0, 5), **options: Any) -> tuple[np.ndarray, np.ndarray]:
    """Radiances of the ball's pixels, and their normals."""
    camera = blinn.Camera.look_at(eye, (0, 0, 0), yfov=25)
    picture = white_ball().render(
        camera, size=(32, 32), layers=["mask", "normal"], hdri=hdri, background="transparent", **RAW, **options
    )
    inside = picture["mask"] > 0.5
    return picture.linear[inside][:, :3], picture["normal"][inside]


@pytest.mark.parametrize(("width", "height"), [(2, 1), (8, 4), (16, 8)])
def test_constant_environments_of_few_texels_are_constant(tmp_path: Path, width: int, height: int) -> None:
    hdri = save_hdr(tmp_path / "a.hdr", np.full((height, width, 3), (0.75, 0.5, 0.25)))
    found, _ = shades(hdri)
    np.testing.assert_allclose(found, np.broadcast_to([0.75, 0.5, 0.25], found.shape), atol=1e-3)


@pytest.mark.parametrize("place", [(30, 0), (30, 127), (60, 70)])
def test_suns_light_one_side_only(tmp_path: Path, place: tuple[int, int]) -> None:
    pixels, to_sun = sun(128, *place)
    hdri = save_hdr(tmp_path / "a.hdr", pixels)
    found, normals = shades(hdri, 5 * to_sun + [0.1, 1, 0.2], bounces=0)
    np.testing.assert_allclose(found[:, 0], 0.2 + 4 * np.maximum(0, normals @ to_sun), rtol=0.01)
    behind, _ = shades(hdri, -5 * to_sun, bounces=0)
    np.testing.assert_allclose(behind, 0.2, atol=2e-3)


def test_suns_are_turned_with_their_environment(tmp_path: Path) -> None:
    pixels, to_sun = sun(128, 20, 30)
    hdri = save_hdr(tmp_path / "a.hdr", pixels)
    angle = np.radians(70)
    c, s = np.cos(angle), np.sin(angle)
    turned = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ to_sun
    found, normals = shades(hdri, bounces=0, hdri_rotate=70, hdri_strength=3)
    np.testing.assert_allclose(found[:, 0], 3 * (0.2 + 4 * np.maximum(0, normals @ turned)), rtol=0.01)


@pytest.mark.parametrize(("color", "factor"), [((25.5,) * 3, 1), ((300,) * 3, 1), ((30, 10, 1), 1), ((50,) * 3, 0.5)])
def test_specular_colours_are_factors(tmp_path: Path, color: tuple[float, ...], factor: float) -> None:
    hdri = save_hdr(tmp_path / "a.hdr", np.full((16, 32, 3), 0.5))
    file = Glb()
    material = file.add(
        "materials",
        pbrMetallicRoughness={"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0, "roughnessFactor": 0},
        extensions={"KHR_materials_specular": {"specularColorFactor": list(color), "specularFactor": factor}},
    )
    scene = blinn.load(file.bytes(file.node(mesh=file.mesh(material=material, NORMAL=FACING))))
    shown = scene.render(CAMERA, size=(9, 9), hdri=hdri, **RAW).linear[4, 4, :3]
    # F0 = min(0.04 color, 1) factor, of the extension's specification.
    np.testing.assert_allclose(shown, 0.5 * factor * np.minimum(0.04 * np.array(color), 1), atol=1e-3)


def beside_light(kind: str, intensity: float, **attributes: Any) -> blinn.Scene:
    """An unlit square of (0.5, 0.2, 0.1) on the left, and a lit one that the light is metered for."""
    file = Glb()
    file.lights({"type": kind, "intensity": intensity})
    factor = [1, 1, 1, 1] if attributes else [0.5, 0.2, 0.1, 1]
    unlit = file.add("materials", pbrMetallicRoughness={"baseColorFactor": factor}, extensions=UNLIT)
    lit = file.add("materials", pbrMetallicRoughness={"metallicFactor": 0})
    left = file.node(mesh=file.mesh(SQUARE * 0.5, material=unlit, **attributes), translation=[-0.6, 0, 0])
    right = file.node(mesh=file.mesh(SQUARE * 0.5, material=lit, NORMAL=FACING), translation=[0.6, 0, 0])
    return blinn.load(file.bytes(left, right, file.light_node(0, translation=[0, 0, 2])))


@pytest.mark.parametrize(("kind", "intensity"), [("directional", 1e5), ("spot", 5e4), ("point", 1e-3)])
@pytest.mark.parametrize("attributes", [{}, {"COLOR_0": np.float32([[0.5, 0.2, 0.1]] * 4)}])
def test_exposure_does_not_change_unlit_colours(kind: str, intensity: float, attributes: dict[str, Any]) -> None:
    scene = beside_light(kind, intensity, **attributes)
    for options in ({}, {"exposure": 3}):
        shown = scene.render(CAMERA, size=(32, 32), samples=1, view="standard", **options).rgba
        assert shown[16, 10].tolist() == [188, 124, 89, 255]


def test_mirrors_show_unlit_colours_as_they_are() -> None:
    file = Glb()
    file.lights({"type": "directional", "intensity": 1e5})
    color = {"baseColorFactor": [0.5, 0.2, 0.1, 1]}
    unlit = file.add("materials", pbrMetallicRoughness=color, extensions=UNLIT, doubleSided=True)
    mirror = file.add("materials", pbrMetallicRoughness={"roughnessFactor": 0})
    wall = file.node(mesh=file.mesh(SQUARE * 4, material=unlit), translation=[0, 0, 8])
    square = file.node(mesh=file.mesh(material=mirror, NORMAL=FACING))
    scene = blinn.load(file.bytes(wall, square, file.light_node(0)))
    assert scene.render(CAMERA, size=(9, 9), samples=1, view="standard").rgba[4, 4].tolist() == [188, 124, 89, 255]
