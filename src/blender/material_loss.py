"""What glTF has no form for in a material, and so is not in the file."""

from __future__ import annotations

from typing import Iterator

import bpy

from .node_links import linked_node

PRINCIPLED = "ShaderNodeBsdfPrincipled"

# Blender's exporter evaluates none of these: their sockets get the value that they have without a link.
PROCEDURES = {
    f"ShaderNode{name}"
    for name in """
    TexNoise TexVoronoi TexWave TexMagic TexChecker TexBrick TexGradient TexWhiteNoise TexGabor TexSky
    TexEnvironment ValToRGB HueSaturation Invert RGBCurve BrightContrast Gamma Fresnel LayerWeight NewGeometry
    ObjectInfo CameraData LightPath AmbientOcclusion Bevel Wireframe Blackbody Wavelength MapRange FloatCurve
    VectorCurve Script ParticleInfo HairInfo PointInfo
    """.split()
}

# Shaders that become a material without values.
SHADERS = {
    f"ShaderNode{name}"
    for name in """
    BsdfDiffuse BsdfGlass BsdfGlossy BsdfAnisotropic BsdfRefraction BsdfTranslucent BsdfToon BsdfSheen BsdfVelvet
    BsdfMetallic BsdfHair BsdfHairPrincipled BsdfRayPortal SubsurfaceScattering AddShader EeveeSpecular
    """.split()
}

# Inputs of a Principled BSDF without a counterpart, and the weight that shows them.
INPUTS = {"Coat Tint": "Coat Weight", "Subsurface Weight": "Subsurface Weight"}

# Sockets of colours. Images of others hold data.
COLORS = {"Base Color", "Emission Color", "Sheen Tint", "Specular Tint"}
SRGB = {"sRGB", "sRGB - Texture", "sRGB Encoded Rec.709"}

MAX_LOSSES = 5


def surface_of(material: bpy.types.Material | None) -> bpy.types.Node | None:
    """Returns the shader of a material's surface."""
    # Materials have nodes from Blender 5.0 on.
    has_nodes = material is not None and (bpy.app.version >= (5, 0, 0) or material.use_nodes)
    if not has_nodes or material.node_tree is None:
        return None
    output = material.node_tree.get_output_node("CYCLES") or material.node_tree.get_output_node("ALL")
    return output and linked_node(output.inputs["Surface"])


def losses(material: bpy.types.Material | None) -> list[str]:
    """Returns what is lost of a material, each as a part of a sentence."""
    surface = surface_of(material)
    if surface is None:
        return []
    found = [f"the shader '{node.bl_label}'" for node in upstream(surface) if node.bl_idname in SHADERS]
    for node in upstream(surface):
        if node.bl_idname == PRINCIPLED:
            found += losses_of_principled(node)
    return list(dict.fromkeys(found))


def message(material: bpy.types.Material, found: list[str]) -> str:
    """Returns the warning that names what a material loses."""
    named = found[:MAX_LOSSES]
    if len(found) > MAX_LOSSES:
        named.append(f"{len(found) - MAX_LOSSES} more")
    advice = "; bake it to an image" if any(" in " in loss for loss in found) else ""
    return f"blinn: material '{material.name}' loses what glTF cannot hold: {', '.join(named)}{advice}"


def is_thin_wall(material: bpy.types.Material | None) -> bool:
    """Returns True for a surface whose shader is a thin wall, which Blender has from version 5.2 on."""
    surface = surface_of(material)
    wall = surface.inputs.get("Thin Wall") if surface is not None and surface.bl_idname == PRINCIPLED else None
    return wall is not None and not wall.is_linked and bool(wall.default_value)


def losses_of_principled(shader: bpy.types.Node) -> Iterator[str]:
    """Yields what is lost of the inputs of a Principled BSDF."""
    for name, weight in INPUTS.items():
        socket, factor = shader.inputs.get(name), shader.inputs.get(weight)
        if socket is None or factor is None or not (factor.is_linked or factor.default_value > 0.0):
            continue
        is_white = name == "Coat Tint" and not socket.is_linked and min(socket.default_value[:3]) >= 1.0
        if not is_white:
            yield name
    for socket in shader.inputs:
        first = linked_node(socket)
        for node in upstream(first) if first is not None else []:
            if node.bl_idname in PROCEDURES:
                yield f"'{node.bl_label}' in {socket.name}"
            elif node.bl_idname == "ShaderNodeTexImage" and socket.name in COLORS and node.image is not None:
                space = node.image.colorspace_settings.name
                if space not in SRGB and not node.image.is_float:
                    yield f"the colour space '{space}' of image '{node.image.name}'"


def upstream(start: bpy.types.Node) -> Iterator[bpy.types.Node]:
    """Yields a node and all that it depends on, each once, with the nodes of groups."""
    waiting, seen = [start], set()
    while waiting:
        node = waiting.pop()
        if node.as_pointer() in seen or node.mute:
            continue
        seen.add(node.as_pointer())
        yield node
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
            outputs = [n for n in node.node_tree.nodes if n.bl_idname == "NodeGroupOutput"]
            waiting.extend(outputs)
        waiting.extend(link.from_node for socket in node.inputs for link in socket.links)
