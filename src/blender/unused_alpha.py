"""Colour images whose alpha no node uses: Cycles and EEVEE multiply their colours by it, readers of glTF ignore it.

The colours that Blender shows are written in their place, without alpha.
"""

from __future__ import annotations

import os
import tempfile
from typing import Any

import bpy
import numpy

from .gltf_types import BinaryData
from .node_links import linked_node

COLORS = {"Base Color", "Emission Color", "Color"}
IMAGE_NODE = "ShaderNodeTexImage"
# A PNG's depth in bits and its kind of colours are the bytes after its size.
PNG_START = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"
BYTES_WITH_ALPHA = b"\x08\x06"


def write(gltf_image: Any, sockets: tuple[Any, ...]) -> None:
    """Replaces the data of an image that the exporter made for the inputs of a shader, in a GLB."""
    data = getattr(getattr(gltf_image, "buffer_view", None), "data", b"")
    if not data.startswith(PNG_START) or data[24:26] != BYTES_WITH_ALPHA:
        return
    nodes = [node for node in map(image_node, sockets) if node is not None]
    if not nodes or not all(node == nodes[0] for node in nodes) or not is_multiplied(nodes[0]):
        return
    png = over_black(nodes[0].image)
    if png is not None:
        gltf_image.buffer_view = BinaryData(png)


def image_node(gltf_socket: Any) -> bpy.types.ShaderNodeTexImage | None:
    """Returns the image node of a colour input; None for other inputs and nodes."""
    socket = getattr(gltf_socket, "socket", gltf_socket)
    if socket.name not in COLORS or not socket.is_linked:
        return None
    node = linked_node(socket)
    if node is not None and node.bl_idname == "ShaderNodeMix":
        # The exporter writes the other factor of a product as a number.
        linked = [linked_node(i) for i in node.inputs if i.type == "RGBA" and i.is_linked]
        node = linked[0] if len(linked) == 1 else None
    return node if node is not None and node.bl_idname == IMAGE_NODE else None


def is_multiplied(node: bpy.types.ShaderNodeTexImage) -> bool:
    """Returns True if Blender multiplies the node's colours by an alpha that nothing uses."""
    image = node.image
    if image is None or image.alpha_mode != "STRAIGHT" or node.outputs["Alpha"].is_linked or image.is_float:
        return False
    # Before 5.1, Blender keeps the colours of these.
    return bpy.app.version >= (5, 1, 0) or image.file_format not in {"WEBP", "BMP"}


def over_black(image: bpy.types.Image) -> bytes | None:
    """Returns a PNG of stored colours multiplied by alpha, rounded down as Cycles does; None if all is opaque."""
    width, height = image.size
    if width * height == 0 or image.channels != 4:
        return None
    texels = numpy.empty(width * height * 4, numpy.float32)
    image.pixels.foreach_get(texels)
    stored = numpy.rint(texels * 255.0).astype(numpy.uint16).reshape(-1, 4)
    if (stored[:, 3] == 255).all():
        return None
    stored[:, :3] = stored[:, :3] * stored[:, 3:] // 255
    stored[:, 3] = 255
    product = bpy.data.images.new("blinn", width, height, alpha=False)
    try:
        product.colorspace_settings.name = image.colorspace_settings.name
        product.pixels.foreach_set((stored / numpy.float32(255.0)).astype(numpy.float32).ravel())
        with tempfile.TemporaryDirectory(prefix="blinn-", ignore_cleanup_errors=True) as folder:
            path = os.path.join(folder, "image.png")
            product.filepath_raw, product.file_format = path, "PNG"
            product.save()
            with open(path, "rb") as file:
                return file.read()
    finally:
        bpy.data.images.remove(product)
