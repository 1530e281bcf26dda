"""Compares Blinn-Phong with GGX for several mappings of coefficients.

Prints the table of docs/decisions/material-conversion.md.

    python docs/scripts/ggx.py            # needs numpy

A ball of base colour 0.8 fills a square picture, seen from far away (v is +Z everywhere) and lit by one sun of
irradiance π at 0, 30, 60 and 90 degrees from the view direction, at roughness 0.1, 0.2, … 1. The reference is a microfacet
surface: GGX's distribution, Smith's height-correlated masking, Schlick's Fresnel term with F0 = 0.04 for dielectrics
and the base colour for metals, over a Lambertian base with the share 1 − F0, which metals lack. The
difference is the mean of |ΔsRGB| of 255 over the ball's pixels, clipped at white, then over lights and roughnesses. `tests/render/ggx_materials.rs` measures the first row through the whole renderer.
"""

import numpy as np

BASE, SIDE = 0.8, 256
ROUGHNESSES = np.arange(1, 11) / 10
ANGLES = np.radians([0, 30, 60, 90])


def ball():
    """Returns the normals of the ball's pixels."""
    at = (np.arange(SIDE) + 0.5) / SIDE * 2 - 1
    x, y = np.meshgrid(at, at)
    r2 = x * x + y * y
    inside = r2 < 1
    return np.stack([x[inside], y[inside], np.sqrt(1 - r2[inside])], -1)


NORMALS = ball()
VIEW = np.array([0.0, 0.0, 1.0])


def srgb(v):
    v = np.clip(v, 0, 1)
    return 255 * np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)


def cosines(angle):
    light = np.array([np.sin(angle), 0, np.cos(angle)])
    half = (light + VIEW) / np.linalg.norm(light + VIEW)
    return NORMALS @ light, NORMALS @ half, NORMALS @ VIEW, half @ VIEW


def f0_of(metallic):
    return 0.04 + (BASE - 0.04) * metallic


def ggx(metallic, roughness, angle):
    nl, nh, nv, vh = cosines(angle)
    lit, nl = nl > 0, np.maximum(nl, 1e-6)
    a2, f0 = roughness**4, f0_of(metallic)
    distribution = a2 / (np.pi * (nh * nh * (a2 - 1) + 1) ** 2)
    masking = lambda c: (np.sqrt(1 + a2 * (1 / c**2 - 1)) - 1) / 2
    visible = 1 / (1 + masking(nl) + masking(nv))
    fresnel = f0 + (1 - f0) * (1 - vh) ** 5
    specular = distribution * fresnel * visible / (4 * nl * nv)
    diffuse = BASE * (1 - metallic) * (1 - f0) / np.pi
    return np.where(lit, np.pi * (specular + diffuse) * nl, 0)


def ours(metallic, roughness):
    """The mapping of src/render/integrator/material/evaluator.rs."""
    alpha, f0 = max(roughness, 0.1) ** 2, f0_of(metallic)
    p = 2 / alpha**2 - 2
    return BASE * (1 - metallic) * (1 - 0.04) + 0.35 * f0 * alpha, f0 * (1 - alpha) * (p + 2) / 8, p


def plain(metallic, roughness):
    """Keeps the energy of the highlight and changes nothing else."""
    alpha, f0 = max(roughness, 0.1) ** 2, f0_of(metallic)
    p = 2 / alpha**2 - 2
    return BASE * (1 - metallic) * (1 - 0.04), f0 * (p + 2) / 8, p


def exporters(metallic, roughness):
    """p = 1000·(1 − roughness)², as Blender's OBJ exporter writes it, and k_s = F0."""
    return BASE * (1 - metallic), f0_of(metallic), 1000 * (1 - roughness) ** 2


def blinn(coefficients, angle):
    k_d, k_s, p = coefficients
    nl, nh, _, _ = cosines(angle)
    return np.where(nl > 0, k_d * np.maximum(nl, 0) + k_s * np.maximum(nh, 0) ** p, 0)


def difference(mapping, metallic):
    pairs = [(r, a) for r in ROUGHNESSES for a in ANGLES]
    off = [np.abs(srgb(blinn(mapping(metallic, r), a)) - srgb(ggx(metallic, r, a))).mean() for r, a in pairs]
    return np.mean(off)


if __name__ == "__main__":
    print("| mapping | dielectric | metal |\n|---|---|---|")
    for mapping in (ours, plain, exporters):
        print(f"| {mapping.__name__} | {difference(mapping, 0):.2f} | {difference(mapping, 1):.2f} |")
