"""Bakes the values of routed materials."""

from __future__ import annotations

from typing import NamedTuple

import bpy
import numpy

from . import bake_scene, material_loss
from .bake_routes import Router
from .bake_scene import Target
from .bake_values import COLORS, NORMALS, VALUES, Values, is_socket
from .journal import Journal


class Plan(NamedTuple):
    """The values of a routed material, and those that are baked."""

    values: Values
    principled: bpy.types.Node | None
    wanted: list[str]


def plan(material: bpy.types.Material, lost: set[str] | None, map_name: str, journal: Journal) -> Plan:
    """Returns what is baked of a material whose nodes may be changed."""
    router = Router(map_name)
    shader = material_loss.surface_of(material)
    try:
        values = router.values(material.node_tree, shader)
    finally:
        for group in router.groups:
            journal.add(bpy.data.node_groups, group)
    wanted = [n for n in (*COLORS, *VALUES, *NORMALS) if is_socket(values.get(n)) and (lost is None or n in lost)]
    if lost is not None and "Normal" in lost and not is_socket(values.get("Normal")):
        # A bump of the output alone.
        diffuse = material.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
        values = {**values, "Normal": diffuse.outputs[0]}
        wanted.append("Normal")
    return Plan(values, router.principled, wanted)


def routed_copy(material: bpy.types.Material | None) -> bpy.types.Material:
    """Returns a copy of a material, or one that is black, for baking."""
    if material is not None:
        copy = material.copy()
        if not material_loss.has_bump(material):
            for link in copy.node_tree.get_output_node("CYCLES").inputs["Displacement"].links:
                copy.node_tree.links.remove(link)
        return copy
    new = bpy.data.materials.new(bake_scene.NAME)
    if bpy.app.version < (5, 0, 0):
        new.use_nodes = True
    return new


def bake_passes(plans: dict[int, Plan], targets: dict[int, Target]) -> dict[int, dict[str, numpy.ndarray]]:
    """Returns the pixels of each value of each material."""
    found: dict[int, dict[str, numpy.ndarray]] = {slot: {} for slot in plans}
    numbers = [list(VALUES[i : i + 3]) for i in range(0, len(VALUES), 3)]
    groups = [[name] for name in COLORS] + numbers + [[name] for name in NORMALS]
    for names in groups:
        present = {slot: [n for n in names if n in plan.wanted] for slot, plan in plans.items()}
        if not any(present.values()):
            continue
        is_normal = names[0] in NORMALS
        for slot, target in targets.items():
            mine = [plans[slot].values[name] for name in present.get(slot, [])]
            if not mine:
                target.show_color((0.0, 0.0, 0.0))
            elif is_normal:
                target.show_shader(mine[0])
            elif names[0] in COLORS:
                target.show_color(mine[0])
            else:
                target.show_numbers(mine)
        bake_scene.bake("NORMAL" if is_normal else "EMIT")
        for slot, mine in present.items():
            pixels = targets[slot].pixels() if mine else None
            for channel, name in enumerate(mine):
                found[slot][name] = pixels[..., channel] if name in VALUES else pixels
    return found
