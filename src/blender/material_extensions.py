"""Values of materials that glTF has fields for and that Blender's exporter leaves out."""

from __future__ import annotations

import math
from typing import Any

import bpy

from . import principled
from .gltf_types import Extension

IOR = "KHR_materials_ior"
IRIDESCENCE = "KHR_materials_iridescence"
SHEEN = "KHR_materials_sheen"
SPECULAR = "KHR_materials_specular"
NEEDED = {"KHR_materials_transmission", "KHR_materials_volume", SPECULAR}

# The index of refraction without the extension.
DEFAULT_IOR = 1.5


def write(gltf_material: Any, shader: bpy.types.Node) -> None:
    """Adds what is missing of a Principled BSDF: index of refraction, thin film, weight of a sheen, tint of a coat."""
    weigh_sheen(gltf_material, shader)
    tint_below_coat(gltf_material, shader)
    present = gltf_material.extensions or {}
    # The exporter begins with empty extensions, and removes those that stay empty.
    filled = {name for name, value in present.items() if getattr(value, "extension", value)}
    added = {}
    ior = constant(shader, "IOR")
    is_kept = NEEDED.intersection(filled)
    if ior is not None and ior >= 1.0 and not math.isclose(ior, DEFAULT_IOR, rel_tol=1e-5) and not is_kept:
        # The exporter removes the index at last without one of them, if only with its default.
        added = {IOR: {"ior": ior}, SPECULAR: {"specularFactor": 1.0}}
    thickness, film = constant(shader, "Thin Film Thickness"), constant(shader, "Thin Film IOR")
    if thickness and film is not None and film >= 1.0 and IRIDESCENCE not in filled:
        # Without a texture, the film is as thick as its maximum.
        added[IRIDESCENCE] = {
            "iridescenceFactor": 1.0,
            "iridescenceIor": film,
            "iridescenceThicknessMaximum": thickness,
        }
    if added:
        values = {name: Extension(name, value, False) for name, value in added.items()}
        gltf_material.extensions = {**present, **values}


def write_glow(gltf_material: Any) -> None:
    """Takes the gloss away that the exporter leaves to a surface which only emits light."""
    present = gltf_material.extensions or {}
    gltf_material.extensions = {**present, SPECULAR: Extension(SPECULAR, {"specularFactor": 0.0}, False)}


def weigh_sheen(gltf_material: Any, shader: bpy.types.Node) -> None:
    """Multiplies the colour of a sheen, which has the tint alone, by its weight."""
    weight = constant(shader, "Sheen Weight")
    values = extension_of(gltf_material, SHEEN)
    if values and weight is not None and "sheenColorFactor" in values:
        values["sheenColorFactor"] = scaled(values["sheenColorFactor"], (min(weight, 1.0),) * 3)


def tint_below_coat(gltf_material: Any, shader: bpy.types.Node) -> None:
    """Multiplies colours by the tint of a coat: coats of glTF have none."""
    tint = principled.constant_coat_tint(shader)
    if tint is None:
        return
    surface = gltf_material.pbr_metallic_roughness
    if surface is not None:
        old = surface.base_color_factor or [1.0] * 4
        surface.base_color_factor = [*scaled(old[:3], tint), old[3]]
    if gltf_material.emissive_factor is not None:
        gltf_material.emissive_factor = scaled(gltf_material.emissive_factor, tint)
    values = extension_of(gltf_material, SPECULAR)
    if values is not None:
        values["specularColorFactor"] = scaled(values.get("specularColorFactor") or [1.0] * 3, tint)


def extension_of(gltf_material: Any, name: str) -> dict[str, Any] | None:
    """Returns the values of an extension; None without it."""
    found = (gltf_material.extensions or {}).get(name)
    return getattr(found, "extension", found)


def scaled(color: Any, factors: Any) -> list[float]:
    """Returns the product of two colours."""
    return [a * b for a, b in zip(color, factors)]


def constant(shader: bpy.types.Node, name: str) -> float | None:
    """Returns the value of an input; None if it is linked or this Blender does not have it."""
    socket = shader.inputs.get(name)
    return None if socket is None or socket.is_linked else socket.default_value
