"""Types of Blender's exporter, whose modules have other names before Blender 5.0."""

from __future__ import annotations

from typing import Any

from io_scene_gltf2.io.com.gltf2_io_extensions import ChildOfRootExtension, Extension

try:
    from io_scene_gltf2.io.exp.binary_data import BinaryData
except ImportError:
    from io_scene_gltf2.io.exp.gltf2_io_binary_data import BinaryData

__all__ = ["BinaryData", "ChildOfRootExtension", "Extension", "add_extras", "set_extras"]

KEY = "blinn"


def add_extras(holder: Any, values: dict[str, Any]) -> None:
    """Adds values to ``extras.blinn`` of a scene, node or camera of the exporter."""
    if values:
        extras = dict(holder.extras or {})
        extras[KEY] = {**extras.get(KEY, {}), **values}
        holder.extras = extras


def set_extras(json: dict[str, Any], values: dict[str, Any]) -> None:
    """Adds values to ``extras.blinn`` of an object that is JSON already."""
    if values:
        json["extras"] = {**(json.get("extras") or {}), KEY: values}
