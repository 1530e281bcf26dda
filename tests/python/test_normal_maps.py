"""Relief of normal maps: an animated or skinned surface shows what its standing or unskinned twin shows."""

import math
from typing import Any

import numpy as np
import pytest

import blinn
from gltf_file import Glb, png

TILTED = np.full((4, 4, 3), np.round((np.array([0.5, 0.3, math.sqrt(0.66)]) * 0.5 + 0.5) * 255), np.uint8)
UVS = np.float32([[0, 1], [1, 1], [1, 0], [0, 0]])
FACING = np.float32([[0, 0, 1]] * 4)
TRANSFORM = "KHR_texture_transform"


def normal(
    *,
    transform: dict[str, Any] | None = None,
    moves: dict[str, Any] | None = None,
    time: float = 1,
    skinned: bool = False,
    above: dict[str, Any] | None = None,
    joint: dict[str, Any] | None = None,
    attributes: dict[str, Any] | None = None,
    eye: float = 5,
) -> list[float]:
    """The shading normal of a square with one tilted normal all over its map."""
    file = Glb()
    texture: dict[str, Any] = {"index": file.texture(png(TILTED))}
    if transform is not None or moves:
        file.use(TRANSFORM)
        texture["extensions"] = {TRANSFORM: transform or {}}
    material = file.add(
        "materials", doubleSided=True, normalTexture=texture, pbrMetallicRoughness={"metallicFactor": 0}
    )
    bones = {"JOINTS_0": np.zeros((4, 4), np.uint8), "WEIGHTS_0": np.float32([[1, 0, 0, 0]] * 4)} if skinned else {}
    given = {"NORMAL": FACING} if attributes is None else attributes
    mesh = file.mesh(material=material, TEXCOORD_0=UVS, **given, **bones)
    bone = file.node(**(joint or {}))
    skin = {"skin": file.add("skins", joints=[bone])} if skinned else {}
    root = file.node(children=[file.node(mesh=mesh, **skin), bone], **(above or {}))
    for path, (value, sampler) in (moves or {}).items():
        rest = {"rotation": 0, "scale": [1, 1], "offset": [0, 0]}[path]
        pointer = f"/materials/0/normalTexture/extensions/{TRANSFORM}"
        file.animate(pointer, path, [0, 1], [rest, value], **sampler)
    scene = blinn.load(file.bytes(root)).pose(time)
    camera = blinn.Camera.look_at((0, 0, eye), (0, 0, 0), yfov=20)
    return scene.render(camera, size=(9, 9), samples=1, layers="normal")["normal"][4, 4].tolist()


STEP = {"interpolation": "STEP"}


@pytest.mark.parametrize(
    ("moves", "time", "standing"),
    [
        ({"scale": ([-1, 1], {})}, 1, {"scale": [-1, 1]}),
        ({"scale": ([1, -2], {})}, 1, {"scale": [1, -2]}),
        ({"rotation": (math.pi, {})}, 0.5, {"rotation": math.pi / 2}),
        ({"rotation": (0.7, {}), "scale": ([-3, 0.5], {})}, 1, {"rotation": 0.7, "scale": [-3, 0.5]}),
        ({"rotation": (1, STEP)}, 0.9, {}),
        ({"rotation": (1, STEP)}, 1, {"rotation": 1}),
    ],
)
def test_animated_transforms_turn_the_relief(moves: dict[str, Any], time: float, standing: dict[str, Any]) -> None:
    expected = normal(transform=standing)
    np.testing.assert_allclose(normal(moves=moves, time=time), expected, atol=4e-3)
    # TANGENT belongs to the coordinates of the file.
    given = {"NORMAL": FACING, "TANGENT": np.float32([[1, 0, 0, 1]] * 4)}
    np.testing.assert_allclose(
        normal(moves=moves, time=time, attributes=given), normal(transform=standing, attributes=given), atol=4e-3
    )


@pytest.mark.parametrize("eye", [5, -5])
@pytest.mark.parametrize(
    "above",
    [
        {"scale": [-1, 1, 1]},
        {"scale": [1, -1, 1]},
        {"scale": [1, 1, -1]},
        {"scale": [-1, -1, -1]},
        {"scale": [-1, 1, 1], "rotation": [0, 0, math.sin(0.3), math.cos(0.3)]},
    ],
)
@pytest.mark.parametrize(
    "attributes", [{}, {"NORMAL": FACING}, {"NORMAL": FACING, "TANGENT": np.float32([[1, 0, 0, 1]] * 4)}]
)
def test_skins_below_mirrored_nodes_keep_their_relief(
    above: dict[str, Any], attributes: dict[str, Any], eye: float
) -> None:
    twin = {"above": above, "attributes": attributes, "eye": eye}
    np.testing.assert_allclose(normal(skinned=True, **twin), normal(**twin), atol=4e-3)


def test_mirrored_joints_are_mirrored_nodes() -> None:
    mirror = {"scale": [-1, 1, 1]}
    np.testing.assert_allclose(normal(skinned=True, joint=mirror), normal(above=mirror), atol=4e-3)
