"""Types and functions of Blender's exporter, whose modules have other names in other versions."""

from __future__ import annotations

from typing import Any

import numpy
from io_scene_gltf2.io.com.gltf2_io import Accessor
from io_scene_gltf2.io.com.gltf2_io_extensions import ChildOfRootExtension, Extension

try:
    from io_scene_gltf2.io.exp.binary_data import BinaryData
except ImportError:
    from io_scene_gltf2.io.exp.gltf2_io_binary_data import BinaryData

__all__ = ["BinaryData", "ChildOfRootExtension", "Extension", "add_extras", "gather_mesh", "new_vectors", "set_extras"]

FLOAT, ARRAY_BUFFER = 5126, 34962

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


def gather_mesh(mesh: Any, materials: tuple[Any, ...], settings: dict[str, Any]) -> Any:
    """Returns the exporter's form of a mesh without skin and modifiers."""
    try:
        # From Blender 5.2 on.
        from io_scene_gltf2.blender.exp.obj_data import gather_mesh as gather
    except ImportError:
        try:
            from io_scene_gltf2.blender.exp.mesh import gather_mesh as gather
        except ImportError:
            from io_scene_gltf2.blender.exp.gltf2_blender_gather_mesh import gather_mesh as gather
    return gather(mesh, None, None, None, materials, None, settings)


def new_vectors(values: numpy.ndarray) -> Accessor:
    """Returns vectors of 32-bit floats, one of each row, as an attribute of vertices."""
    count, width = values.shape
    view = BinaryData(values.astype(numpy.float32).tobytes(), bufferViewTarget=ARRAY_BUFFER)
    names = ["byte_offset", "extensions", "extras", "max", "min", "name", "normalized", "sparse"]
    kind = {"component_type": FLOAT, "count": count, "type": f"VEC{width}"}
    return Accessor(buffer_view=view, **kind, **dict.fromkeys(names))
