"""Values of opaque materials that glTF has extensions for and that Blender's exporter leaves out."""

from __future__ import annotations

import math
from typing import Any

import bpy

from .gltf_types import Extension

IOR = "KHR_materials_ior"
IRIDESCENCE = "KHR_materials_iridescence"

SPECULAR = "KHR_materials_specular"
NEEDED = {"KHR_materials_transmission", "KHR_materials_volume", SPECULAR}

# The index of refraction without the extension.
DEFAULT_IOR = 1.5


def write(gltf_material: Any, shader: bpy.types.Node) -> None:
    """Adds the index of refraction and the thin film of a Principled BSDF where they are missing."""
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


def constant(shader: bpy.types.Node, name: str) -> float | None:
    """Returns the value of an input; None if it is linked or this Blender does not have it."""
    socket = shader.inputs.get(name)
    return None if socket is None or socket.is_linked else socket.default_value
