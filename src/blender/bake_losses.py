"""What of a material is to be baked."""

from __future__ import annotations

from typing import Iterable

import bpy

from . import material_loss, principled
from .bake_values import COLORS, DIRECTION, NORMALS, VALUES
from .node_links import linked_node

# Nodes, and outputs of texture coordinates, whose values differ or do not differ between objects with the same mesh.
OF_OBJECTS = {f"ShaderNode{name}" for name in ("ObjectInfo", "NewGeometry", "ParticleInfo", "VectorTransform")}
OF_MESHES = {"UV", "Generated", "Object"}

# Values that inputs are a part of.
VALUES_OF_INPUTS = {
    **dict.fromkeys(("Emission Color", "Emission Strength"), "Emission"),
    **dict.fromkeys(("Sheen Tint", "Sheen Weight"), "Sheen Color"),
    **dict.fromkeys(("Anisotropic Rotation", "Tangent"), "Anisotropic"),
    "Coat Tint": "Base Color",
}


def lost_values(material: bpy.types.Material) -> set[str] | None:
    """Returns the values of a Principled BSDF that are to be baked; None for the whole surface."""
    shader = material_loss.surface_of(material)
    if shader is None:
        return set()
    if shader.bl_idname != material_loss.PRINCIPLED:
        return None if is_lost_mix(shader) or material_loss.losses(material) else set()
    names = {socket.name for socket in shader.inputs if any(material_loss.losses_of_socket(socket))}
    names.update(name for name, _ in principled.misread(shader))
    lost = {VALUES_OF_INPUTS.get(name, name) for name in names}
    # The exporter writes heights as a normal map.
    bent = {name for name in NORMALS if any(n.bl_idname == "ShaderNodeBump" for n in before(shader.inputs[name]))}
    lost |= bent | ({"Normal"} if material_loss.has_bump(material) else set())
    if lost and principled.has_coat_tint(shader):
        # A coat has no tint in the file.
        lost.update(principled.BELOW_COAT)
    if "Anisotropic" in lost:
        lost.update(DIRECTION)
        if shader.inputs["Normal"].is_linked:
            # Readers have one tangent, along the map of the normals.
            lost.add("Normal")
    for pair in (("Metallic", "Roughness"), ("Base Color", "Alpha"), ("Coat Weight", "Coat Roughness")):
        # One image holds both.
        if lost.intersection(pair):
            lost.update(name for name in pair if linked_node(shader.inputs[name]) is not None)
    return lost.intersection({*COLORS, *VALUES, *NORMALS})


def is_lost_mix(shader: bpy.types.Node) -> bool:
    """Returns True for several surfaces, or a group, that depend on nodes which the exporter does not evaluate.

    Light alone is not baked: the exporter reads it.
    """
    if shader.bl_idname not in {"ShaderNodeMixShader", "ShaderNodeAddShader", "ShaderNodeGroup"}:
        return False
    nodes = list(material_loss.upstream(shader))
    surfaces = [n for n in nodes if n.bl_idname.startswith("ShaderNodeBsdf")]
    groups = [n for n in nodes if n.bl_idname == "ShaderNodeGroup" and n != shader and has_shader(n)]
    if all(n.bl_idname == "ShaderNodeBsdfTransparent" for n in surfaces):
        return False
    has_procedure = any(n.bl_idname in material_loss.PROCEDURES for n in nodes)
    return has_procedure or shader.bl_idname != "ShaderNodeGroup" and len(surfaces) + len(groups) > 1


def has_shader(group: bpy.types.Node) -> bool:
    """Returns True for a group that is linked as a shader."""
    return any(socket.type == "SHADER" and socket.is_linked for socket in group.outputs)


def before(socket: bpy.types.NodeSocket) -> Iterable[bpy.types.Node]:
    """Returns the nodes that an input depends on."""
    first = linked_node(socket)
    return [] if first is None else material_loss.upstream(first)


def depends_on_object(material: bpy.types.Material) -> bool:
    """Returns True for a material that differs between objects with the same mesh."""
    shader = material_loss.surface_of(material)
    for node in material_loss.upstream(shader) if shader is not None else []:
        if node.bl_idname in OF_OBJECTS:
            return True
        used = {output.name for output in node.outputs if output.is_linked}
        if node.bl_idname == "ShaderNodeTexCoord" and (used - OF_MESHES or node.object is not None):
            return True
    return False
