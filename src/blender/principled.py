"""Inputs of a Principled BSDF that Blender's exporter leaves out or reads in another way than Cycles."""

from __future__ import annotations

from typing import Iterator

import bpy

from .node_links import linked_node

WHITE = (1.0, 1.0, 1.0)
# Light below a coat has the power of its tint by 1/cos in the coat. This is the mean over a ball, at the index 1.5.
COAT_DEPTH = 1.146
# Colours that light has which passes a coat.
BELOW_COAT = ("Base Color", "Emission", "Specular Tint")


def is_used(socket: bpy.types.NodeSocket | None) -> bool:
    """Returns True for a weight that is linked or not 0."""
    return socket is not None and (socket.is_linked or socket.default_value > 0.0)


def has_coat_tint(shader: bpy.types.Node) -> bool:
    """Returns True for a coat that colours what is below it."""
    tint = shader.inputs.get("Coat Tint")
    if tint is None or not is_used(shader.inputs.get("Coat Weight")):
        return False
    return tint.is_linked or tuple(tint.default_value[:3]) != WHITE


def constant_coat_tint(shader: bpy.types.Node) -> tuple[float, ...] | None:
    """Returns the colour that light has below a coat, in the mean; None without one that is constant."""
    if not has_coat_tint(shader) or shader.inputs["Coat Tint"].is_linked or shader.inputs["Coat Weight"].is_linked:
        return None
    weight = min(shader.inputs["Coat Weight"].default_value, 1.0)
    tint = (channel**COAT_DEPTH for channel in shader.inputs["Coat Tint"].default_value[:3])
    return tuple(1.0 - weight + weight * channel for channel in tint)


def is_stretched_otherwise(shader: bpy.types.Node) -> bool:
    """Returns True for highlights that are stretched along other directions than those of a UV map, as in glTF."""
    if not is_used(shader.inputs.get("Anisotropic")):
        return False
    node = linked_node(shader.inputs["Tangent"])
    return node is None or node.bl_idname != "ShaderNodeTangent" or node.direction_type != "UV_MAP"


def has_stretch_image(shader: bpy.types.Node) -> bool:
    """Returns True for an anisotropy with the nodes that Blender's importer makes of a texture."""
    product = linked_node(shader.inputs["Anisotropic"])
    if product is None or product.bl_idname != "ShaderNodeMath" or product.operation != "MULTIPLY":
        return False
    split = linked_node(product.inputs[0])
    vector = linked_node(split.inputs[0]) if split is not None and split.bl_idname == "ShaderNodeSeparateXYZ" else None
    return vector is not None and vector.bl_idname == "ShaderNodeVectorMath" and has_plain_image(vector.inputs[0])


def has_plain_image(socket: bpy.types.NodeSocket | None) -> bool:
    """Returns True for an input that is an image, or a channel of one."""
    node = linked_node(socket) if socket is not None else None
    if node is not None and node.bl_idname in {"ShaderNodeSeparateColor", "ShaderNodeSeparateRGB"}:
        node = linked_node(node.inputs[0])
    return node is not None and node.bl_idname == "ShaderNodeTexImage"


def misread(shader: bpy.types.Node) -> Iterator[tuple[str, str]]:
    """Yields inputs whose values are lost though no procedure is linked, and each as a part of a sentence."""
    if has_coat_tint(shader) and constant_coat_tint(shader) is None:
        yield "Coat Tint", "the colours in Coat Tint"
    if has_plain_image(shader.inputs.get("Sheen Weight")):
        yield "Sheen Weight", "the image in Sheen Weight"
    # The level 0.5 is the factor 1 of glTF.
    if has_plain_image(shader.inputs.get("Specular IOR Level")):
        yield "Specular IOR Level", "half of the image in Specular IOR Level"
    if is_stretched_otherwise(shader):
        yield "Anisotropic", "the directions in Anisotropic"
