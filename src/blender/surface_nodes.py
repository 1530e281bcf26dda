"""Reads the shaders of a material as the Principled BSDF that is nearest."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Callable

import bpy

from . import material_loss, panorama
from .surface_values import BLACK, PLAIN, WHITE, CannotHold, Mask, Surface, Value
from .surface_values import covered, is_constant, luminance_of, mix_of, passing_mix, plain, product, sum_of

MAX_DEPTH = 64
FRESNEL = {"ShaderNodeFresnel", "ShaderNodeLayerWeight"}
OPERATIONS: dict[str, Callable[[float, float], float]] = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "MAXIMUM": max,
    "MINIMUM": min,
    "GREATER_THAN": lambda a, b: float(a > b),
    "LESS_THAN": lambda a, b: float(a < b),
}
# A shader that lets all light pass, and one without any.
CLEAR = plain(Alpha=0.0)
NOTHING = plain()


class Reader:
    """Reads the shaders of a tree."""

    def __init__(self, tree: bpy.types.NodeTree) -> None:
        self.tree = tree

    def surface(self, socket: bpy.types.NodeSocket, depth: int = 0) -> Surface:
        """Returns the surface that is linked to an input."""
        link = self.link(socket)
        if link is None:
            return NOTHING
        if depth > MAX_DEPTH:
            raise CannotHold("shaders that are nested too deep")
        node = link.from_node
        if node.mute:
            raise CannotHold(f"the muted node '{node.name}'")
        read = READERS.get(node.bl_idname)
        if read is None:
            raise CannotHold(f"the shader '{node.bl_label}'")
        return read(self, node, depth)

    def link(self, socket: bpy.types.NodeSocket) -> bpy.types.NodeLink | None:
        """Returns the link of an input, past reroutes."""
        for _ in range(MAX_DEPTH):
            if not socket.is_linked:
                return None
            link = socket.links[0]
            if link.from_node.bl_idname != "NodeReroute":
                return link
            socket = link.from_node.inputs[0]
        return None

    def value(self, socket: bpy.types.NodeSocket) -> Value:
        """Returns the number or the colour of an input, or the output that it is linked to."""
        link = self.link(socket)
        if link is None:
            if socket.type == "RGBA":
                return tuple(socket.default_value[:3])
            return socket.default_value if socket.type == "VALUE" else None
        node, output = link.from_node, link.from_socket
        if node.mute:
            raise CannotHold(f"the muted node '{node.name}'")
        if node.bl_idname == "ShaderNodeValue":
            return output.default_value
        if node.bl_idname == "ShaderNodeRGB":
            return tuple(output.default_value[:3])
        if node.bl_idname == "ShaderNodeLightPath":
            # As seen by the camera.
            return float(output.name == "Is Camera Ray")
        if node.bl_idname == "ShaderNodeMath" and node.operation in OPERATIONS:
            a, b = (self.value(node.inputs[i]) for i in (0, 1))
            if isinstance(a, float) and isinstance(b, float):
                found = OPERATIONS[node.operation](a, b)
                return min(max(found, 0.0), 1.0) if node.use_clamp else found
        if output.id_data != self.tree:
            raise CannotHold(f"'{node.bl_label}' in a group")
        return output

    def number(self, socket: bpy.types.NodeSocket) -> float | None:
        """Returns the number of an input; None if it is not constant."""
        value = self.value(socket)
        return luminance_of(value) if is_constant(value) else None

    def coverage(self, socket: bpy.types.NodeSocket) -> tuple[Value, bool]:
        """Returns the factor of a mix, and True if it is an inverted output."""
        value, is_inverted = self.value(socket), False
        for _ in range(MAX_DEPTH):
            if is_constant(value):
                share = min(max(luminance_of(value), 0.0), 1.0)
                return 1.0 - share if is_inverted else share, False
            node = value.node
            if node.bl_idname == "ShaderNodeInvert" and self.number(node.inputs[0]) == 1.0:
                value = self.value(node.inputs[1])
            elif node.bl_idname == "ShaderNodeMath" and node.operation == "SUBTRACT":
                if self.number(node.inputs[0]) != 1.0:
                    break
                value = self.value(node.inputs[1])
            else:
                break
            is_inverted = not is_inverted
        return value, is_inverted


def principled(reader: Reader, node: bpy.types.Node, _: int) -> Surface:
    """Reads a Principled BSDF."""
    if node.id_data != reader.tree:
        raise CannotHold(f"the shader '{node.bl_label}' in a group")
    values = {name: reader.value(node.inputs[name]) for name in PLAIN if name in node.inputs}
    return Surface({**PLAIN, **values}, node)


def diffuse(reader: Reader, node: bpy.types.Node, _: int) -> Surface:
    return plain(Base_Color=reader.value(node.inputs["Color"]), Normal=reader.value(node.inputs["Normal"]))


def toon(reader: Reader, node: bpy.types.Node, depth: int) -> Surface:
    surface = diffuse(reader, node, depth)
    if node.component == "GLOSSY":
        surface = surface.with_values(Metallic=1.0, Roughness=reader.value(node.inputs["Size"]))
    return replace(surface, losses=(f"the shader '{node.bl_label}'",))


def subsurface(reader: Reader, node: bpy.types.Node, depth: int) -> Surface:
    return diffuse(reader, node, depth).with_values(Subsurface_Weight=1.0)


def glossy(reader: Reader, node: bpy.types.Node, depth: int) -> Surface:
    strength = reader.number(node.inputs["Anisotropy"])
    losses = () if strength == 0.0 else ("Anisotropy",)
    surface = diffuse(reader, node, depth).with_values(Metallic=1.0, Roughness=reader.value(node.inputs["Roughness"]))
    return replace(surface, losses=losses)


def metal(reader: Reader, node: bpy.types.Node, _: int) -> Surface:
    inputs = node.inputs
    if node.fresnel_type == "F82":
        color = reader.value(inputs["Base Color"])
    else:
        if any(inputs[name].is_linked for name in ("IOR", "Extinction")):
            raise CannotHold(f"'{node.bl_label}' with linked indices")
        indices = (inputs[name].default_value for name in ("IOR", "Extinction"))
        color = tuple(normal_reflectance(n, k) for n, k in zip(*indices))
    losses = () if reader.number(inputs["Anisotropy"]) == 0.0 else ("Anisotropy",)
    values = {"Base_Color": color, "Roughness": reader.value(inputs["Roughness"])}
    return replace(plain(**values, Metallic=1.0, Normal=reader.value(inputs["Normal"])), losses=losses)


def normal_reflectance(n: float, k: float) -> float:
    """Returns the reflectance of a metal by its complex index, as seen from the front."""
    return ((n - 1.0) ** 2 + k * k) / ((n + 1.0) ** 2 + k * k)


def glass(reader: Reader, node: bpy.types.Node, _: int) -> Surface:
    inputs = node.inputs
    color = reader.value(inputs["Color"])
    if is_constant(color):
        # Each of two interfaces has the square root of a Principled BSDF's colour.
        color = tuple(channel * channel for channel in color)
    index = reader.number(inputs["IOR"])
    values = {"Base_Color": color, "Roughness": reader.value(inputs["Roughness"]), "Transmission_Weight": 1.0}
    values["IOR"] = PLAIN["IOR"] if index is None else index
    level = 0.0 if node.bl_idname == "ShaderNodeBsdfRefraction" else 0.5
    return plain(**values, Specular_IOR_Level=level, Normal=reader.value(inputs["Normal"]))


def translucent(reader: Reader, node: bpy.types.Node, depth: int) -> Surface:
    surface = diffuse(reader, node, depth)
    return replace(surface, passing=1.0, passing_color=surface.values["Base Color"])


def emission(reader: Reader, node: bpy.types.Node, _: int) -> Surface:
    color, strength = (reader.value(node.inputs[name]) for name in ("Color", "Strength"))
    return plain(Emission_Color=color, Emission_Strength=strength)


def sheen(reader: Reader, node: bpy.types.Node, _: int) -> Surface:
    color = reader.value(node.inputs["Color"])
    roughness = node.inputs.get("Roughness") or node.inputs["Sigma"]
    values = {"Sheen_Tint": color, "Sheen_Roughness": reader.value(roughness)}
    return plain(**values, Sheen_Weight=1.0, Normal=reader.value(node.inputs["Normal"]))


def transparent(reader: Reader, node: bpy.types.Node, _: int) -> Surface:
    """Reads a Transparent BSDF: a grey one is black in part, one of a colour is glass that does not refract."""
    color = reader.value(node.inputs["Color"])
    if not is_constant(color):
        raise CannotHold(f"the colours of '{node.bl_label}'")
    if max(color) - min(color) < 1e-3:
        return plain(Alpha=1.0 - min(max(color), 1.0))
    clear = {"Base_Color": color, "Roughness": 0.0, "IOR": 1.0, "Transmission_Weight": 1.0}
    return replace(plain(**clear), is_thin=True)


def mix(reader: Reader, node: bpy.types.Node, depth: int) -> Surface:
    """Reads a Mix Shader: a clear part becomes alpha, and a gloss by Fresnel's equations that of a dielectric."""
    factor, is_inverted = reader.coverage(node.inputs[0])
    first, second = node.inputs[1:3]
    if is_inverted:
        first, second = second, first
    if factor in (0.0, 1.0):
        return reader.surface(second if factor == 1.0 else first, depth + 1)
    parts = reader.surface(first, depth + 1), reader.surface(second, depth + 1)
    if not is_constant(factor):
        return mix_by_node(reader, parts, factor)
    for index, part in enumerate(parts):
        if is_clear(part):
            return covered(parts[1 - index], 1.0 - factor if index == 1 else factor)
    if 1.0 in (parts[0].passing, parts[1].passing) and parts[0].passing != parts[1].passing:
        return passing_mix(*parts, factor)
    return mix_of(*parts, factor)


def mix_by_node(reader: Reader, parts: tuple[Surface, Surface], factor: bpy.types.NodeSocket) -> Surface:
    """Returns the mix of two surfaces by an image or by Fresnel's equations."""
    first, second = parts
    if factor.node.bl_idname in FRESNEL:
        return dielectric(reader, first, second, factor)
    procedures = [node for node in material_loss.upstream(factor.node) if node.bl_idname in material_loss.FACTORS]
    if procedures:
        raise CannotHold(f"'{procedures[0].bl_label}' in a factor")
    for surface, part, is_inverted in ((second, first, False), (first, second, True)):
        if is_clear(part):
            return covered(surface, mask(factor, is_inverted))
    raise CannotHold("a mix by an image")


def mask(factor: bpy.types.NodeSocket, is_inverted: bool) -> Value:
    """Returns the coverage by an output: a new image if the one that it has holds other numbers."""
    image = factor.node.image if factor.node.bl_idname == "ShaderNodeTexImage" else None
    if image is None:
        if is_inverted:
            raise CannotHold("an inverted factor")
        return factor
    is_alpha = factor.name == "Alpha"
    has_other_numbers = not is_alpha and image.colorspace_settings.name not in panorama.LINEAR
    return Mask(factor, is_inverted) if is_inverted or has_other_numbers else factor


def dielectric(reader: Reader, first: Surface, second: Surface, factor: bpy.types.NodeSocket) -> Surface:
    """Returns a surface below a gloss that grows at its rim."""
    if second.values["Metallic"] != 1.0 or first.values["Metallic"] != 0.0:
        raise CannotHold(f"a mix by '{factor.node.bl_label}'")
    index = reader.number(factor.node.inputs[0])
    if index is None:
        raise CannotHold(f"a link to '{factor.node.bl_label}'")
    if factor.node.bl_idname == "ShaderNodeLayerWeight":
        # Its factor "Facing" has no index.
        index = 1.0 / max(1.0 - index, 0.1) if factor.name == "Fresnel" else 1.5
    if is_clear(first):
        first = replace(plain(Base_Color=WHITE, Transmission_Weight=1.0), is_thin=True)
    tint = second.values["Base Color"]
    gloss = {"Roughness": second.values["Roughness"], "IOR": max(index, 1.0), "Specular_IOR_Level": 0.5}
    if first.values["Transmission Weight"] == 1.0:
        gloss["IOR"] = gloss["IOR"] if first.is_thin else first.values["IOR"]
    found = first.with_values(**gloss, Specular_Tint=tint, Normal=first.values["Normal"] or second.values["Normal"])
    return replace(found, losses=first.losses + second.losses)


def is_clear(surface: Surface) -> bool:
    """Returns True for a surface that lets all light pass."""
    return surface.values["Alpha"] == 0.0


def add(reader: Reader, node: bpy.types.Node, depth: int) -> Surface:
    """Reads an Add Shader of which one part emits light or has none."""
    parts = [reader.surface(socket, depth + 1) for socket in node.inputs[:2]]
    for light, surface in (parts, parts[::-1]):
        names = ("Base Color", "Metallic", "Specular IOR Level", "Transmission Weight", "Sheen Weight", "Alpha")
        expected = (BLACK, 0.0, 0.0, 0.0, 0.0, 1.0)
        if all(light.values[name] == value for name, value in zip(names, expected)) and light.passing == 0.0:
            return sum_of(surface, light) if not is_clear(surface) else fail(node)
    return fail(node)


def fail(node: bpy.types.Node) -> Any:
    raise CannotHold(f"the shader '{node.bl_label}'")


READERS: dict[str, Callable[[Reader, bpy.types.Node, int], Surface]] = {
    "ShaderNodeBsdfPrincipled": principled,
    "ShaderNodeBsdfDiffuse": diffuse,
    "ShaderNodeBsdfToon": toon,
    "ShaderNodeSubsurfaceScattering": subsurface,
    "ShaderNodeBsdfGlossy": glossy,
    "ShaderNodeBsdfAnisotropic": glossy,
    "ShaderNodeBsdfMetallic": metal,
    "ShaderNodeBsdfGlass": glass,
    "ShaderNodeBsdfRefraction": glass,
    "ShaderNodeBsdfTranslucent": translucent,
    "ShaderNodeEmission": emission,
    "ShaderNodeBsdfSheen": sheen,
    "ShaderNodeBsdfVelvet": sheen,
    "ShaderNodeBsdfTransparent": transparent,
    "ShaderNodeMixShader": mix,
    "ShaderNodeAddShader": add,
}
