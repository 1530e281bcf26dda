"""The world: a constant colour, or an equirectangular picture with its rotation and strength.

Worlds of other nodes become such a picture.
"""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy
from mathutils import Quaternion

from . import panorama, world_picture
from .gltf_types import BinaryData
from .node_links import linked_node

# From Blender's axes to those of glTF: (x, y, z) becomes (x, z, -y).
TO_GLTF = Quaternion((1.0, 0.0, 0.0), -math.pi / 2.0)


class UnsupportedWorld(Exception):
    """A world that is neither a colour nor a picture that is only turned."""


def extras(world: bpy.types.World | None, settings: dict[str, Any]) -> dict[str, Any] | None:
    """Returns the world's linear radiance as ``color``, or a picture; None, with a message, if neither can be had."""
    if world is None:
        return {"color": [0.0, 0.0, 0.0]}
    try:
        return background(world, settings)
    except UnsupportedWorld as found:
        reason = str(found)
    try:
        return rendered(world, settings)
    except (world_picture.CannotRender, RuntimeError) as error:
        settings["log"].warning(f"blinn: world '{world.name}' is not written: {reason}, and {error}")
        return None


def rendered(world: bpy.types.World, settings: dict[str, Any]) -> dict[str, Any]:
    """Returns the light of a world of any nodes."""
    texels = world_picture.render(world, is_seen=False)
    if world_picture.has_light_path(world.node_tree):
        seen = world_picture.render(world, is_seen=True)
        if not numpy.allclose(texels, seen, rtol=0.05, atol=1e-3):
            text = f"'{world.name}' is that of light"
            settings["log"].warning(f"blinn: the camera sees another world than the one that lights the scene: {text}")
    color = world_picture.color_of(texels)
    if color is not None:
        return {"color": color}
    encoded = world_picture.encode(texels)
    return {
        "bufferView": BinaryData(encoded.data),
        "mimeType": encoded.mime_type,
        "strength": 1.0,
        "rotation": turned(Quaternion(), settings["gltf_yup"]),
    }


def background(world: bpy.types.World, settings: dict[str, Any]) -> dict[str, Any]:
    """Returns the world of a Background node."""
    # Worlds have nodes from Blender 5.0 on.
    has_nodes = bpy.app.version >= (5, 0, 0) or world.use_nodes
    if not has_nodes or world.node_tree is None:
        return {"color": list(world.color)}
    output = world.node_tree.get_output_node("ALL")
    surface = output and linked_node(output.inputs["Surface"])
    if surface is None:
        return {"color": [0.0, 0.0, 0.0]}
    if surface.bl_idname != "ShaderNodeBackground":
        raise UnsupportedWorld(f"its surface is '{surface.name}', not a Background")
    if surface.inputs["Strength"].is_linked:
        raise UnsupportedWorld("the strength of its background comes from nodes")
    strength = surface.inputs["Strength"].default_value
    color = surface.inputs["Color"]
    if not color.is_linked:
        return {"color": [strength * channel for channel in color.default_value[:3]]}
    texture = linked_node(color)
    if texture is None or texture.bl_idname != "ShaderNodeTexEnvironment":
        raise UnsupportedWorld(
            f"its colour comes from '{texture.name if texture else '?'}', not an Environment Texture"
        )
    return picture(texture, strength, settings)


def picture(texture: bpy.types.ShaderNodeTexEnvironment, strength: float, settings: dict[str, Any]) -> dict[str, Any]:
    """Returns the picture of an Environment Texture. ``strength`` multiplies its radiance."""
    if texture.projection != "EQUIRECTANGULAR":
        raise UnsupportedWorld(f"'{texture.name}' is a mirror ball")
    encoded = panorama.encode(texture.image) if texture.image else None
    if encoded is None:
        raise UnsupportedWorld(f"'{texture.name}' has no picture that can be read")
    return {
        "bufferView": BinaryData(encoded.data),
        "mimeType": encoded.mime_type,
        "strength": strength,
        "rotation": rotation(texture, settings["gltf_yup"]),
    }


def rotation(texture: bpy.types.ShaderNodeTexEnvironment, is_y_up: bool) -> list[float]:
    """Returns the rotation of the picture as a quaternion x, y, z, w in the axes of the file.

    Without rotation, the middle of the picture is towards Blender's +X: glTF's +X.
    """
    return turned(picture_rotation(texture), is_y_up)


def turned(from_picture: Quaternion, is_y_up: bool) -> list[float]:
    """Returns a rotation in Blender's axes as one of the file."""
    to_file = TO_GLTF if is_y_up else Quaternion()
    w, x, y, z = to_file @ from_picture @ TO_GLTF.inverted()
    return [x, y, z, w]


def picture_rotation(texture: bpy.types.ShaderNodeTexEnvironment) -> Quaternion:
    """Returns the rotation from directions of the picture to those of the world, in Blender's axes."""
    mapping = linked_node(texture.inputs["Vector"])
    if mapping is None or is_direction(mapping, texture.inputs["Vector"]):
        return texture_mapping(texture)
    if mapping.bl_idname != "ShaderNodeMapping":
        raise UnsupportedWorld(f"the direction of its picture comes from '{mapping.name}'")
    source = linked_node(mapping.inputs["Vector"])
    if source is not None and not is_direction(source, mapping.inputs["Vector"]):
        raise UnsupportedWorld(f"the direction of its picture comes from '{source.name}'")
    inputs = [mapping.inputs[name] for name in ("Rotation", "Scale")]
    if any(socket.is_linked for socket in inputs):
        raise UnsupportedWorld(f"'{mapping.name}' has linked values")
    location = mapping.inputs.get("Location")
    has_location = location is not None and location.enabled and any(abs(v) > 1e-6 for v in location.default_value)
    if has_location or any(abs(v - 1.0) > 1e-6 for v in mapping.inputs["Scale"].default_value):
        raise UnsupportedWorld(f"'{mapping.name}' moves or scales its picture")
    turn = mapping.inputs["Rotation"].default_value.to_quaternion()
    # A texture is turned like the mapping, a point the other way.
    return (turn if mapping.vector_type == "TEXTURE" else turn.inverted()) @ texture_mapping(texture)


def texture_mapping(texture: bpy.types.ShaderNodeTexEnvironment) -> Quaternion:
    """Returns the rotation of the node's own mapping, which old files have."""
    turn = texture.texture_mapping.rotation.to_quaternion()
    return turn if texture.texture_mapping.vector_type == "TEXTURE" else turn.inverted()


def is_direction(node: bpy.types.Node, socket: bpy.types.NodeSocket) -> bool:
    """Returns True for a node whose linked output is the direction of the view: coordinates that are generated."""
    if node.bl_idname == "ShaderNodeTexCoord":
        link = socket.links[0]
        while link.from_node.bl_idname == "NodeReroute":
            link = link.from_node.inputs[0].links[0]
        return link.from_socket.name == "Generated"
    return False
