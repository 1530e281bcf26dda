"""A vertex attribute that is the same at all corners is the same all over a triangle."""

from typing import Any

import numpy as np
import pytest

import blinn
from gltf_file import Glb, png

CAMERA = blinn.Camera.look_at((0, 0, 5), (0, 0, 0), yfov=30)


def triangles() -> np.ndarray:
    """Triangles in all directions, a third of them thin."""
    random = np.random.default_rng(5)
    positions = random.uniform(-1, 1, (60, 3, 3)) * [1, 1, 0.3]
    positions[::3, 2] = positions[::3, 1] + random.uniform(-0.05, 0.05, (20, 3))
    return np.float32(positions.reshape(-1, 3))


def repeated(row: Any, dtype: Any = np.float32) -> np.ndarray:
    return np.array([row] * 180, dtype)


def render(file: Glb, material: int, layer: str, **attributes: Any) -> np.ndarray:
    turned = [0.1, 0.2, 0.3, 0.9273618]
    node = file.node(mesh=file.mesh(triangles(), np.arange(180), material=material, **attributes), rotation=turned)
    return blinn.load(file.bytes(node)).render(CAMERA, size=(129, 129), samples=1, layers=layer)[layer]


@pytest.mark.parametrize("dtype", [np.float32, np.uint8, np.uint16])
@pytest.mark.parametrize("alpha", [0.7, 0.3, 1 / 3, 0.999])
def test_alpha_at_the_cutoff_has_no_holes(dtype: Any, alpha: float) -> None:
    if dtype == np.float32:
        white, cutoff, members = [1, 1, 1, alpha], float(np.float32(alpha)), {}
    else:
        top = np.iinfo(dtype).max
        white, members = [top, top, top, round(alpha * top)], {"normalized": True}
        cutoff = round(alpha * top) / top
    counts = []
    for mode in ({"alphaMode": "MASK", "alphaCutoff": cutoff}, {}):
        file = Glb()
        material = file.add("materials", doubleSided=True, **mode)
        colors = file.accessor(repeated(white, dtype), **members)
        counts.append((render(file, material, "mask", COLOR_0=colors) > 0.5).sum())
    assert counts[0] == counts[1] > 4000


@pytest.mark.parametrize("uv", [(0.25, 0.5), (0.5, 0.125), (0, 1), (0.25, 0.999999), (-0.25, 2.5), (100.25, 0.5)])
def test_palettes_are_not_speckled_at_borders_of_texels(uv: tuple[float, float]) -> None:
    palette = np.uint8([[[60 * i + 15, 255 - 60 * i, 60 * j + 10] for i in range(4)] for j in range(4)])
    file = Glb()
    nearest = file.add("samplers", magFilter=9728, minFilter=9728)
    texture = {"index": file.texture(png(palette), sampler=nearest)}
    material = file.add("materials", doubleSided=True, pbrMetallicRoughness={"baseColorTexture": texture})
    found = render(file, material, "albedo", TEXCOORD_0=repeated(uv)).reshape(-1, 3)
    (color,) = np.unique(found[found.sum(-1) > 0], axis=0)
    texel = palette[int(np.floor(uv[1] * 4)) % 4, int(np.floor(uv[0] * 4)) % 4] / 255
    linear = np.where(texel <= 0.04045, texel / 12.92, ((texel + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(color, linear, atol=1e-3)


def test_colours_and_coordinates_are_exact() -> None:
    for layer, name, row in [("albedo", "COLOR_0", [0.3, 0.7, 0.1]), ("uv", "TEXCOORD_0", [0.3, 0.1])]:
        file = Glb()
        found = render(file, file.add("materials", doubleSided=True), layer, **{name: repeated(row)})
        seen = found[(found != 0).any(-1)]
        assert len(seen) > 4000 and (seen == np.float32(row)).all()
