"""Animated scenes: one exposure for the light of a clip, and values at the times of keys."""

from typing import Any

import numpy as np
import pytest

import blinn
from gltf_file import Glb

CAMERA = blinn.Camera.look_at((0, 0, 5), (0, 0, 0), yfov=20)
FACING = np.float32([[0, 0, 1]] * 4)
POINT = {"type": "point", "intensity": 100}
SUN = {"type": "directional", "intensity": 1000}
VISIBILITY = "KHR_node_visibility"


def lit_square(light: dict[str, Any], place: Any, **node: Any) -> tuple[Glb, tuple[int, ...], int]:
    """A white square below a light whose parent may have members of its own. Returns also the roots and the parent."""
    file = Glb()
    file.lights(light)
    material = file.add("materials", pbrMetallicRoughness={"metallicFactor": 0}, doubleSided=True)
    square = file.node(mesh=file.mesh(material=material, NORMAL=FACING))
    parent = file.node(children=[file.light_node(0, translation=list(place))], **node)
    return file, (square, parent), parent


def shown(scene: blinn.Scene, **options: Any) -> list[int]:
    return scene.render(CAMERA, size=(9, 9), samples=1, background="#000000", **options).rgba[4, 4].tolist()


@pytest.mark.parametrize(
    ("light", "path", "keys"),
    [
        (POINT, "translation", [[0, 0, 50], [0, 0, 0]]),
        (SUN, "rotation", [[0, 1, 0, 0], [0, 0, 0, 1]]),
    ],
)
def test_moving_lights_are_metered_over_the_clip(light: dict[str, Any], path: str, keys: Any) -> None:
    file, roots, _ = lit_square(light, (0, 0, 2))
    steady = shown(blinn.load(file.bytes(*roots)))
    assert 60 < steady[0] < 250
    for reverse in (False, True):
        file, roots, parent = lit_square(light, (0, 0, 2))
        file.animate(parent, path, [0, 1], keys[::-1] if reverse else keys)
        scene = blinn.load(file.bytes(*roots))
        assert shown(scene.pose(0 if reverse else 1)) == steady
        assert shown(scene.pose(1 if reverse else 0))[0] < 60


@pytest.mark.parametrize("first", [0, 1])
def test_lamps_that_are_switched_are_lights_of_the_file(first: int) -> None:
    file, roots, _ = lit_square(POINT, (0, 0, 2))
    steady = shown(blinn.load(file.bytes(*roots)))
    file, roots, parent = lit_square(POINT, (0, 0, 2), extensions={VISIBILITY: {"visible": bool(first)}})
    keys = file.accessor(np.uint8([first, 1 - first]))
    file.animate(f"/nodes/{parent}/extensions/{VISIBILITY}", "visible", [0, 1], [0, 1], interpolation="STEP")
    file.json["animations"][0]["samplers"][0]["output"] = keys
    scene = blinn.load(file.bytes(*roots))
    assert shown(scene.pose(1 - first)) == steady
    assert shown(scene.pose(first)) == [0, 0, 0, 255]


@pytest.mark.parametrize("fps", [24, 25, 29.97, 30, 60])
@pytest.mark.parametrize("rounding", ["product", "quotient", "sum"])
def test_steps_are_shown_at_the_frames_of_their_keys(fps: float, rounding: str) -> None:
    frames = np.arange(120)
    step = np.float32(1 / fps)
    times = {
        "product": np.float32(frames) * step,
        "quotient": np.float32(frames / fps),
        "sum": np.cumsum(np.r_[np.float32(0), np.full(119, step)], dtype=np.float32),
    }[rounding]
    file = Glb()
    node = file.node(mesh=file.mesh())
    file.animate(node, "translation", times, [[0, 0, -i] for i in frames], interpolation="STEP")
    scene = blinn.load(file.bytes(node))
    assert [round(-scene.pose(i / fps).bounds[0, 2]) for i in frames] == frames.tolist()


def test_cameras_that_move_into_the_light_are_metered_over_the_clip() -> None:
    def scene(*, moves: bool) -> blinn.Scene:
        file = Glb()
        file.lights({**POINT, "intensity": 300})
        material = file.add("materials", pbrMetallicRoughness={"metallicFactor": 0})
        mesh = file.mesh(material=material, NORMAL=FACING)
        squares = [file.node(mesh=mesh), file.node(mesh=mesh, translation=[30, 0, 0])]
        file.add("cameras", type="perspective", perspective={"yfov": 0.3, "znear": 0.1})
        camera = file.node(camera=0, translation=[0, 0, 5])
        if moves:
            file.animate(camera, "translation", [0, 1], [[30, 0, 5], [0, 0, 5]])
        return blinn.load(file.bytes(*squares, file.light_node(0, translation=[0, 0, 2]), camera))

    def middle(posed: blinn.Scene) -> list[int]:
        return posed.render(size=(9, 9), samples=1).rgba[4, 4].tolist()

    steady = middle(scene(moves=False))
    assert 60 < steady[0] < 250
    assert middle(scene(moves=True).pose(1)) == steady
