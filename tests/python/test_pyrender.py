"""The page on pyrender: pictures of a grey square with lights as it converts them, beside those of pyrender 0.1.45.

The square has a base colour of .5, metallic 0 and roughness 1, and fills the view of a camera at (0, 0, 2).
"""

import math

import numpy as np
import pytest

import blinn

SQUARE = {"vertices": [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], "faces": [[0, 1, 2], [0, 2, 3]]}


def centre(base_color: float = 0.5, **options: object) -> int:
    material = {"base_color": [base_color] * 3, "metallic": 0, "roughness": 1}
    scene = blinn.Scene.from_arrays(**SQUARE, material=material)
    camera = blinn.Camera.look_at((0, 0, 2), (0, 0, 0), yfov=45)
    pixel = scene.render(camera, size=(64, 64), exposure=0, **options).rgba[32, 32]
    assert pixel[0] == pixel[1] == pixel[2]
    return int(pixel[0])


@pytest.mark.parametrize(
    ("pyrender", "options"),
    [
        (177, {"sun": (0, 0, -1, 3 / math.pi)}),  # DirectionalLight(intensity=3)
        (108, {"sun": (0, 0, -1, 1 / math.pi)}),  # DirectionalLight(intensity=1)
        (130, {"sun": (-math.sqrt(0.75), 0, -0.5, 3 / math.pi)}),  # the same with 3, at 60 degrees
        (163, {"point_light": (0, 0, 2, 10 / math.pi)}),  # PointLight(intensity=10)
        (108, {"lights": "none", "ambient": 0.3}),  # Scene(ambient_light=[.3, .3, .3])
    ],
)
def test_lights_are_about_as_bright(pyrender: int, options: dict[str, object]) -> None:
    assert abs(centre(**options) - pyrender) <= 8


def test_flat_colours_and_backgrounds_are_equal() -> None:
    # RenderFlags.FLAT, and bg_color=[.5, .5, .5, 1], are 128 in pyrender.
    assert centre(0.21404114, integrator="color") == 128
    scene = blinn.Scene.from_arrays(**SQUARE)
    wide = blinn.Camera.look_at((0, 0, 90), (0, 0, 0), yfov=45)
    picture = scene.render(wide, size=(32, 32), background="srgb(.5)")
    assert np.all(picture.rgba[0] == [128, 128, 128, 255])
