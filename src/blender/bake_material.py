"""Materials with baked images in place of nodes."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy

from . import material_loss, principled
from .bake_passes import Plan
from .bake_values import BLACK, DIRECTION, NORMAL_MIX, NORMALS, PLAIN_VALUES, Values, connect, is_socket
from .journal import Journal

# Images, and the values in their channels.
PACKED = {
    "Metallic Roughness": {"Roughness": "Green", "Metallic": "Blue"},
    "Transmission": {"Transmission Weight": "Red"},
    "Coat": {"Coat Weight": "Red", "Coat Roughness": "Green"},
    "Sheen Roughness": {"Sheen Roughness": "Red"},
}
# Values that are the input of the same name.
INPUTS = ("Base Color", "Specular Tint", "Anisotropic", *PLAIN_VALUES)
# A mix of normals is soft if more than this share of the texels of its second part shows more than this share of both.
SOFT_TEXELS, SOFT_SHARE = 0.25, 0.1
Pixels = dict[str, numpy.ndarray]


class BakedMaterial:
    """A copy of a material whose nodes are replaced."""

    def __init__(self, material: bpy.types.Material, map_name: str, journal: Journal) -> None:
        self.name, self.map_name, self.journal = material.name, map_name, journal
        self.material = journal.add(bpy.data.materials, material.copy())
        self.tree = self.material.node_tree

    def write(self, plan: Plan, baked: Pixels, lost: set[str] | None) -> None:
        """Replaces what was lost. A whole surface gets a new Principled BSDF, with all its values."""
        shader = self.new_surface(plan.principled) if lost is None else material_loss.surface_of(self.material)
        self.write_numbers(shader, plan.values, lost)
        self.write_color(shader, plan.values, baked)
        self.write_emission(shader, baked)
        if "Sheen Color" in baked:
            texture = self.texture("Sheen", srgb(baked["Sheen Color"]), None, is_color=True)
            self.replace(texture.outputs["Color"], shader.inputs["Sheen Tint"])
            self.set_number(shader, "Sheen Weight", 1.0)
        self.write_specular(shader, plan.values, baked)
        if DIRECTION[0] in baked:
            self.write_stretch(shader, plan.values, baked)
        for name, channels in PACKED.items():
            present = {value: channel for value, channel in channels.items() if value in baked}
            if present:
                self.write_packed(name, shader, present, baked)
        for name in NORMALS:
            if name in baked:
                node = self.tree.nodes.new("ShaderNodeNormalMap")
                node.uv_map = self.map_name
                texture = self.texture(name, baked[name], None)
                self.tree.links.new(texture.outputs["Color"], node.inputs["Color"])
                self.tree.links.new(node.outputs[0], shader.inputs[name])

    def new_surface(self, like: bpy.types.Node | None) -> bpy.types.Node:
        """Returns a new Principled BSDF with the numbers of another one."""
        shader = self.tree.nodes.new(material_loss.PRINCIPLED)
        if like is not None:
            for old in like.inputs:
                new = shader.inputs.get(old.name)
                if new is not None and not old.is_linked and hasattr(old, "default_value"):
                    new.default_value = old.default_value
        output = self.tree.get_output_node("CYCLES")
        self.tree.links.new(shader.outputs[0], output.inputs["Surface"])
        return shader

    def write_numbers(self, shader: bpy.types.Node, values: Values, lost: set[str] | None) -> None:
        """Writes those of the values that are no images."""
        names = {name for name, value in values.items() if not is_socket(value) and (lost is None or name in lost)}
        for name in names.intersection(INPUTS):
            self.set_number(shader, name, values[name])
        for name, color, strength in (
            ("Emission", "Emission Color", "Emission Strength"),
            ("Sheen Color", "Sheen Tint", "Sheen Weight"),
        ):
            if name in names:
                peak = max(values[name])
                tint = tuple(channel / peak for channel in values[name]) if peak > 0.0 else BLACK
                self.set_number(shader, color, tint)
                self.set_number(shader, strength, peak)
        if lost is None or "Base Color" in lost:
            # Its light is part of the colours.
            self.set_number(shader, "Coat Tint", principled.WHITE)

    def set_number(self, shader: bpy.types.Node, name: str, value: Any) -> None:
        """Gives an input a number or a colour in place of its links."""
        for link in shader.inputs[name].links:
            self.tree.links.remove(link)
        connect(self.tree, value, shader.inputs[name])

    def write_color(self, shader: bpy.types.Node, values: Values, baked: Pixels) -> None:
        """Writes base colour and alpha into one image."""
        if "Base Color" not in baked and "Alpha" not in baked:
            return
        alpha = baked.get("Alpha")
        size = next(iter(baked.values())).shape[0]
        color = baked.get("Base Color")
        if color is None:
            constant = numpy.array(values.get("Base Color", (1.0,) * 3), numpy.float32)
            color = numpy.broadcast_to(constant, (size, size, 3))
        texture = self.texture("Base Color", srgb(color), alpha, is_color=True)
        self.replace(texture.outputs["Color"], shader.inputs["Base Color"])
        if alpha is not None:
            self.replace(texture.outputs["Alpha"], shader.inputs["Alpha"])

    def write_emission(self, shader: bpy.types.Node, baked: Pixels) -> None:
        """Writes an image whose brightest channel is 1, and its strength."""
        if "Emission" not in baked:
            return
        light = numpy.maximum(baked["Emission"], 0.0)
        peak = float(light.max())
        for socket in (shader.inputs["Emission Color"], shader.inputs["Emission Strength"]):
            for link in socket.links:
                self.tree.links.remove(link)
        shader.inputs["Emission Strength"].default_value = peak
        if peak > 0.0:
            texture = self.texture("Emission", srgb(light / peak), None, is_color=True)
            self.tree.links.new(texture.outputs["Color"], shader.inputs["Emission Color"])

    def write_specular(self, shader: bpy.types.Node, values: Values, baked: Pixels) -> None:
        """Writes the specular factor, twice the level of Blender, and the specular colour, which has what exceeds 1."""
        factor = baked.get("Specular IOR Level")
        color = baked.get("Specular Tint")
        if factor is not None:
            factor = 2.0 * numpy.maximum(factor, 0.0)
            if factor.max() > 1.0 + 1.0 / 255.0:
                tint = values.get("Specular Tint", principled.WHITE) if color is None else color
                tint = numpy.array(principled.WHITE if is_socket(tint) else tint, numpy.float32)
                color = numpy.maximum(factor, 1.0)[..., None] * tint
            self.write_packed("Specular", shader, {"Specular IOR Level": "Red"}, {"Specular IOR Level": factor})
        if color is not None:
            peak = max(float(color.max()), 1.0)
            texture = self.texture("Specular Tint", srgb(color / peak), None, is_color=True)
            product = self.tree.nodes.new("ShaderNodeMix")
            product.data_type, product.blend_type = "RGBA", "MULTIPLY"
            product.inputs[0].default_value = 1.0
            product.inputs[7].default_value = (peak, peak, peak, 1.0)
            self.tree.links.new(texture.outputs["Color"], product.inputs[6])
            self.replace(product.outputs[2], shader.inputs["Specular Tint"])

    def write_stretch(self, shader: bpy.types.Node, values: Values, baked: Pixels) -> None:
        """Writes strength and direction of an anisotropy, with the nodes that the exporter knows."""
        nodes, link = self.tree.nodes, self.tree.links.new
        direction = numpy.stack([2.0 * baked[name] - 1.0 for name in DIRECTION], axis=-1)
        length = numpy.linalg.norm(direction, axis=-1, keepdims=True)
        direction = numpy.where(length > 1e-3, direction / numpy.maximum(length, 1e-3), (1.0, 0.0))
        strength = baked.get("Anisotropic")
        factor = 1.0 if strength is not None else values["Anisotropic"]
        texels = numpy.ones((*direction.shape[:2], 3), numpy.float32)
        texels[..., :2] = 0.5 * direction + 0.5
        if strength is not None:
            texels[..., 2] = strength
        texture = self.texture("Anisotropy", texels, None)
        signed, split = nodes.new("ShaderNodeVectorMath"), nodes.new("ShaderNodeSeparateXYZ")
        signed.operation = "MULTIPLY_ADD"
        signed.inputs[1].default_value, signed.inputs[2].default_value = (2.0, 2.0, 1.0), (-1.0, -1.0, 0.0)
        link(texture.outputs["Color"], signed.inputs[0])
        link(signed.outputs[0], split.inputs[0])
        turned = self.number("ADD", self.number("ARCTAN2", split.outputs["Y"], split.outputs["X"]), 0.0)
        self.replace(self.number("DIVIDE", turned, 2.0 * math.pi), shader.inputs["Anisotropic Rotation"])
        self.replace(self.number("MULTIPLY", split.outputs["Z"], factor), shader.inputs["Anisotropic"])
        tangent = nodes.new("ShaderNodeTangent")
        tangent.direction_type, tangent.uv_map = "UV_MAP", self.map_name
        self.replace(tangent.outputs[0], shader.inputs["Tangent"])

    def number(self, operation: str, first: Any, second: Any) -> bpy.types.NodeSocket:
        """Returns the output of a new node."""
        node = self.tree.nodes.new("ShaderNodeMath")
        node.operation = operation
        connect(self.tree, first, node.inputs[0])
        connect(self.tree, second, node.inputs[1])
        return node.outputs[0]

    def write_packed(self, name: str, shader: bpy.types.Node, channels: dict[str, str], baked: Pixels) -> None:
        """Writes numbers into channels of an image."""
        some = next(iter(channels))
        values = numpy.ones((*baked[some].shape, 3), numpy.float32)
        split = self.tree.nodes.new("ShaderNodeSeparateColor")
        for value, channel in channels.items():
            values[..., ("Red", "Green", "Blue").index(channel)] = baked[value]
            self.replace(split.outputs[channel], shader.inputs[value])
        texture = self.texture(name, values, None)
        self.tree.links.new(texture.outputs["Color"], split.inputs["Color"])

    def replace(self, output: bpy.types.NodeSocket, target: bpy.types.NodeSocket) -> None:
        """Links an input anew."""
        for link in target.links:
            self.tree.links.remove(link)
        self.tree.links.new(output, target)

    def texture(self, name: str, color: numpy.ndarray, alpha: Any, is_color: bool = False) -> bpy.types.Node:
        """Returns an Image Texture on the map that was baked."""
        height, width = color.shape[:2]
        image = bpy.data.images.new(f"{self.name} {name}", width, height, alpha=alpha is not None, is_data=not is_color)
        self.journal.add(bpy.data.images, image)
        texels = numpy.ones((height, width, 4), dtype=numpy.float32)
        texels[..., :3] = color
        if alpha is not None:
            texels[..., 3] = alpha
        image.pixels.foreach_set(numpy.clip(texels, 0.0, 1.0).ravel())
        image.pack()
        node = self.tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        place = self.tree.nodes.new("ShaderNodeUVMap")
        place.uv_map = self.map_name
        self.tree.links.new(place.outputs[0], node.inputs["Vector"])
        return node


def srgb(linear: numpy.ndarray) -> numpy.ndarray:
    """Returns colours as images of bytes store them."""
    linear = numpy.clip(linear, 0.0, 1.0)
    return numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)


def has_soft_mix(plan: Plan, baked: Pixels) -> bool:
    """Returns True for a mix of surfaces with different normals that are seen at the same place."""
    factor = numpy.asarray(baked.get(NORMAL_MIX, plan.values.get(NORMAL_MIX, 0.0)))
    second = factor[factor > SOFT_SHARE]
    return numpy.count_nonzero(second < 1.0 - SOFT_SHARE) > SOFT_TEXELS * second.size
