"""World and render settings of files: what `scene_settings` and `world` write, the other way round."""

from __future__ import annotations

import os
import tempfile
from typing import Any

import bpy
from mathutils import Quaternion

from .import_values import members, number, numbers, set_number
from .world import TO_GLTF

SUFFIXES = {"image/x-exr": ".exr", "image/vnd.radiance": ".hdr"}
MAX_SIDE = 65536


def read(scene: bpy.types.Scene, values: dict[str, Any], gltf: Any) -> None:
    """Gives a scene the size of its pictures, frames, view, film and world."""
    render = scene.render
    size = numbers(values, "resolution", 2)
    if size is not None and all(4 <= side <= MAX_SIDE for side in size):
        render.resolution_x, render.resolution_y = (int(side) for side in size)
    percentage = number(values, "percentage", 1, 32767)
    set_number(render, "resolution_percentage", percentage and int(percentage))
    aspect = number(values, "pixelAspect", 0.005, 200.0)
    if aspect is not None:
        render.pixel_aspect_x, render.pixel_aspect_y = max(1.0, aspect), max(1.0, 1.0 / aspect)
    read_region(render, members(values, "region"))
    read_frames(scene, members(values, "frames"))
    read_view(scene, members(values, "view"))
    if isinstance(values.get("filmTransparent"), bool):
        render.film_transparent = values["filmTransparent"]
    world = members(values, "world")
    if world:
        read_world(scene, world, gltf)


def read_region(render: bpy.types.RenderSettings, region: dict[str, Any]) -> None:
    """Sets the render region, in fractions of the picture."""
    low, high = numbers(region, "min", 2), numbers(region, "max", 2)
    render.use_border = low is not None and high is not None
    if render.use_border:
        render.border_min_x, render.border_min_y = low
        render.border_max_x, render.border_max_y = high


def read_frames(scene: bpy.types.Scene, frames: dict[str, Any]) -> None:
    """Sets the frame range and the frames per second."""
    for name, key in (("frame_start", "start"), ("frame_end", "end"), ("frame_step", "step")):
        value = number(frames, key, 0, 1048574)
        set_number(scene, name, value and int(value))
    rate = number(frames, "rate", 1e-3, 1e4)
    if rate is not None:
        scene.render.fps = max(1, round(rate))
        scene.render.fps_base = scene.render.fps / rate


def read_view(scene: bpy.types.Scene, view: dict[str, Any]) -> None:
    """Sets view transform, look, exposure and gamma. Those that this Blender does not have stay as they are."""
    settings = scene.view_settings
    for name, key in (("view_transform", "transform"), ("look", "look")):
        try:
            setattr(settings, name, view[key])
        except (KeyError, TypeError):
            pass
    set_number(settings, "exposure", number(view, "exposure"))
    set_number(settings, "gamma", number(view, "gamma", 0.0, 5.0))


def read_world(scene: bpy.types.Scene, values: dict[str, Any], gltf: Any) -> None:
    """Gives a scene a new world: a colour, or a picture with its rotation."""
    color, rotation = numbers(values, "color", 3), numbers(values, "rotation", 4)
    view = values.get("bufferView")
    image = None if color is not None or not isinstance(view, int) else read_image(view, values.get("mimeType"), gltf)
    if color is None and image is None:
        return
    world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    scene.world = world
    nodes, links = world.node_tree.nodes, world.node_tree.links
    background = next(node for node in nodes if node.bl_idname == "ShaderNodeBackground")
    if color is not None:
        background.inputs["Color"].default_value = (*color, 1.0)
        background.inputs["Strength"].default_value = 1.0
        return
    strength = number(values, "strength", 0.0)
    background.inputs["Strength"].default_value = 1.0 if strength is None else strength
    place, mapping = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    mapping.vector_type = "TEXTURE"
    x, y, z, w = rotation or (0.0, 0.0, 0.0, 1.0)
    turn = TO_GLTF.inverted() @ Quaternion((w, x, y, z)) @ TO_GLTF
    mapping.inputs["Rotation"].default_value = turn.to_euler()
    links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], background.inputs["Color"])


def read_image(view: int, mime_type: Any, gltf: Any) -> bpy.types.Image | None:
    """Returns a packed picture; None if the file does not have it."""
    from io_scene_gltf2.io.imp.gltf2_io_binary import BinaryData

    suffix = SUFFIXES.get(mime_type) if isinstance(mime_type, str) else None
    if suffix is None or not 0 <= view < len(gltf.data.buffer_views or []):
        return None
    data = bytes(BinaryData.get_buffer_view(gltf, view))
    with tempfile.TemporaryDirectory(prefix="blinn-") as folder:
        path = os.path.join(folder, f"World{suffix}")
        with open(path, "wb") as file:
            file.write(data)
        image = bpy.data.images.load(path, check_existing=False)
        image.pack()
    image.filepath = ""
    return image
