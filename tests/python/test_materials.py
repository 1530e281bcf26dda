"""Keys of materials: each changes the picture of a ball as its extension does, and wrong values are explained."""

import numpy as np
import pytest

import blinn

BASE = {"base_color": (0.5, 0.3, 0.2), "roughness": 0.3}
GLASS = {"base_color": (1, 1, 1), "roughness": 0, "transmission": 1, "ior": 1.5, "thickness": 1}


def ball() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A ball of 48 × 24 quads as triangles, with texture coordinates."""
    down, around = np.meshgrid(np.linspace(0, np.pi, 25), np.linspace(0, 2 * np.pi, 49), indexing="ij")
    vertices = np.stack([np.sin(down) * np.cos(around), np.cos(down), np.sin(down) * np.sin(around)], -1)
    uvs = np.stack([around / (2 * np.pi), down / np.pi], -1)
    i, j = np.meshgrid(np.arange(24), np.arange(48), indexing="ij")
    a = (i * 49 + j).ravel()
    faces = np.concatenate([np.c_[a, a + 1, a + 50], np.c_[a, a + 50, a + 49]])
    return vertices.reshape(-1, 3), faces, uvs.reshape(-1, 2)


def picture(**material: object) -> np.ndarray:
    vertices, faces, uvs = ball()
    scene = blinn.Scene.from_arrays(vertices, faces, normals=vertices, uvs=uvs, material=material)
    assert scene.warnings == []
    return scene.render(size=(48, 48), samples=4, hdri="sky").rgba.astype(int)


@pytest.mark.parametrize(
    ("base", "keys"),
    [
        (BASE, {"clearcoat": 1}),
        (BASE | {"clearcoat": 1}, {"clearcoat_roughness": 0.5}),
        (BASE, {"sheen_color": (1, 1, 1)}),
        (BASE | {"sheen_color": (1, 1, 1), "sheen_roughness": 0.2}, {"sheen_roughness": 0.9}),
        (BASE | {"metallic": 1}, {"anisotropy": 0.9}),
        (BASE | {"metallic": 1, "anisotropy": 0.9}, {"anisotropy_rotation": 1.5}),
        (BASE, {"iridescence": 1, "iridescence_thickness": 400}),
        (BASE | {"iridescence": 1, "iridescence_thickness": 400}, {"iridescence_thickness": 600}),
        (BASE | {"iridescence": 1, "iridescence_thickness": 400}, {"iridescence_ior": 2}),
        (BASE, {"diffuse_transmission": 1}),
        (BASE | {"diffuse_transmission": 1}, {"diffuse_transmission_color": (0, 1, 0)}),
        (GLASS, {"thickness": 0}),
        (GLASS, {"dispersion": 5}),
        (GLASS, {"ior": 2}),
        (GLASS | {"attenuation_distance": 1}, {"attenuation_color": (0.1, 0.9, 0.1)}),
        (GLASS | {"attenuation_color": (0.1, 0.9, 0.1)}, {"attenuation_distance": 0.5}),
        (BASE, {"specular": 0}),
        (BASE, {"specular_color": (0, 0, 0)}),
        (BASE | {"emissive": (0.2, 0.1, 0)}, {"emissive_strength": 3}),
    ],
)
def test_every_key_of_a_layer_changes_the_picture(base: dict, keys: dict) -> None:
    before, after = picture(**base), picture(**base | keys)
    assert np.abs(after - before)[..., :3].max() > 8, keys


def test_dispersion_separates_colours() -> None:
    spread = lambda p: np.ptp(p[..., :3], axis=-1).max()
    plain, prism = (picture(**GLASS, dispersion=value) for value in (0, 20))
    assert spread(prism) > spread(plain) + 8


def test_info_knows_every_key() -> None:
    keys = GLASS | {
        "metallic": 0.25, "roughness": 0.5, "transmission": 0.75, "attenuation_color": (0.5, 0.25, 1),
        "attenuation_distance": 2, "dispersion": 5, "specular": 0.5, "specular_color": (1, 0.5, 0.25),
        "emissive": (1, 0.5, 0), "emissive_strength": 4, "clearcoat": 0.5, "clearcoat_roughness": 0.25,
        "sheen_color": (0.5, 0.25, 0), "sheen_roughness": 0.5, "anisotropy": 0.5, "anisotropy_rotation": 1.5,
        "iridescence": 0.5, "iridescence_ior": 1.25, "iridescence_thickness": 300,
        "diffuse_transmission": 0.25, "diffuse_transmission_color": (0, 1, 0.5),
        "alpha_mode": "mask", "alpha_cutoff": 0.25,
    }  # fmt: skip
    vertices, faces, uvs = ball()
    scene = blinn.Scene.from_arrays(vertices, faces, normals=vertices, uvs=uvs, material=keys)
    material = scene.info["materials"][0]
    assert material["reflectance"] == {
        "metallic": 0.25, "roughness": 0.5, "ior": 1.5, "specular": 0.5, "specular_color": [1, 0.5, 0.25],
    }  # fmt: skip
    assert material["emission"] == [4, 2, 0]
    assert material["alpha"] == {"mode": "mask", "factor": 1, "cutoff": 0.25}
    assert material["normal_map"] is None
    layers = material["layers"]
    assert layers["transmission"] == {"factor": 0.75, "color": None}
    assert layers["volume"] == {
        "thickness": 1, "attenuation_color": [0.5, 0.25, 1], "attenuation_distance": 2,
    }  # fmt: skip
    assert layers["dispersion"] == 5
    assert layers["clearcoat"] == {"factor": 0.5, "roughness": 0.25, "normal_map": False}
    assert layers["sheen"] == {"color": [0.5, 0.25, 0], "roughness": 0.5}
    assert layers["anisotropy"] == {"strength": 0.5, "rotation": 1.5}
    assert layers["iridescence"]["ior"] == 1.25 and layers["iridescence"]["thickness_nm"][1] == 300
    assert layers["diffuse_transmission"] == {"factor": 0.25, "color": [0, 1, 0.5]}


def test_wrong_values_are_explained() -> None:
    for keys, message in [
        ({"iridescence": float("nan")}, "iridescence must be finite"),
        ({"sheen_color": (1, float("inf"), 0)}, "sheen_color must be finite"),
        ({"iridescense": 1}, "unknown material keys"),
    ]:
        with pytest.raises(ValueError, match=message):
            picture(**keys)
