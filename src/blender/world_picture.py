"""Worlds of any nodes as equirectangular pictures that Cycles renders, in a scene of its own."""

from __future__ import annotations

import math
import os
import tempfile

import bpy
import numpy

from .journal import Journal
from .panorama import EncodedImage, radiance_bytes

NAME = "blinn world"
WIDTH = 1024
# Of each pixel. The sun of a sky is two pixels wide.
SAMPLES = 16
# A picture whose channels differ by no more than this share is one colour.
FLAT = 1e-3


class CannotRender(Exception):
    """A world that Cycles cannot render."""


def render(world: bpy.types.World, is_seen: bool) -> numpy.ndarray:
    """Returns the radiance of a world, the uppermost row first, with Blender's +X in the middle.

    `is_seen` chooses what the camera sees, else what lights matte surfaces.
    """
    journal = Journal()
    try:
        copy = journal.add(bpy.data.worlds, world.copy())
        fix_light_paths(copy.node_tree, is_seen, journal)
        scene = journal.add(bpy.data.scenes, bpy.data.scenes.new(NAME))
        scene.world = copy
        camera = journal.add(bpy.data.cameras, bpy.data.cameras.new(NAME))
        make_panoramic(camera)
        item = journal.add(bpy.data.objects, bpy.data.objects.new(NAME, camera))
        item.rotation_euler = (math.pi / 2.0, 0.0, -math.pi / 2.0)
        scene.collection.objects.link(item)
        scene.camera = item
        return render_scene(scene, journal)
    finally:
        journal.restore()


def make_panoramic(camera: bpy.types.Camera) -> None:
    """Makes a camera see all directions."""
    camera.type = "PANO"
    # Of Cycles alone before Blender 5.0.
    settings = camera if hasattr(camera, "panorama_type") else camera.cycles
    settings.panorama_type = "EQUIRECTANGULAR"


def render_scene(scene: bpy.types.Scene, journal: Journal) -> numpy.ndarray:
    """Returns the pixels of a scene as Cycles renders it."""
    render = scene.render
    render.engine = "CYCLES"
    if not hasattr(scene, "cycles"):
        raise CannotRender("Cycles is disabled")
    settings = scene.cycles
    settings.device, settings.seed, settings.samples = "CPU", 0, SAMPLES
    settings.use_denoising = settings.use_adaptive_sampling = False
    settings.pixel_filter_type, settings.filter_width = "BOX", 1.0
    render.resolution_x, render.resolution_y, render.resolution_percentage = WIDTH, WIDTH // 2, 100
    render.use_compositing = render.use_sequencer = False
    image_settings = render.image_settings
    image_settings.file_format, image_settings.color_mode, image_settings.color_depth = "OPEN_EXR", "RGB", "32"
    with tempfile.TemporaryDirectory(prefix="blinn-", ignore_cleanup_errors=True) as folder:
        render.filepath = os.path.join(folder, "world.exr")
        try:
            bpy.ops.render.render(write_still=True, scene=scene.name)
            image = journal.add(bpy.data.images, bpy.data.images.load(render.filepath, check_existing=False))
        except RuntimeError as error:
            raise CannotRender(f"Cycles failed: {error}") from error
        width, height = image.size
        texels = numpy.empty(width * height * image.channels, numpy.float32)
        image.pixels.foreach_get(texels)
    return texels.reshape(height, width, -1)[::-1, :, :3]


def fix_light_paths(tree: bpy.types.NodeTree, is_seen: bool, journal: Journal) -> None:
    """Gives the kinds of rays the values of those of the camera, or of matte surfaces, also in groups."""
    kinds = {"Is Camera Ray": float(is_seen), "Is Diffuse Ray": float(not is_seen)}
    for node in list(tree.nodes):
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None and has_light_path(node.node_tree):
            node.node_tree = journal.add(bpy.data.node_groups, node.node_tree.copy())
            fix_light_paths(node.node_tree, is_seen, journal)
        if node.bl_idname != "ShaderNodeLightPath":
            continue
        for output in node.outputs:
            for link in list(output.links):
                value = tree.nodes.new("ShaderNodeValue")
                value.outputs[0].default_value = kinds.get(output.name, 0.0)
                tree.links.new(value.outputs[0], link.to_socket)


def has_light_path(tree: bpy.types.NodeTree | None, depth: int = 0) -> bool:
    """Returns True for nodes that depend on the kind of a ray."""
    if tree is None or depth > 16:
        return False
    groups = [node.node_tree for node in tree.nodes if node.bl_idname == "ShaderNodeGroup"]
    has_own = any(node.bl_idname == "ShaderNodeLightPath" for node in tree.nodes)
    return has_own or any(has_light_path(group, depth + 1) for group in groups)


def color_of(texels: numpy.ndarray) -> list[float] | None:
    """Returns the colour of a picture that has one alone."""
    low, high = (edge(texels, axis=(0, 1)) for edge in (numpy.min, numpy.max))
    is_flat = bool((high - low <= FLAT * numpy.maximum(high, 1e-6)).all())
    return [float(channel) for channel in texels.mean(axis=(0, 1), dtype=numpy.float64)] if is_flat else None


def encode(texels: numpy.ndarray) -> EncodedImage:
    """Returns the picture as a file."""
    return EncodedImage(radiance_bytes(texels), "image/vnd.radiance")
