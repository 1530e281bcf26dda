"""The objects of a scene whose materials are baked."""

from __future__ import annotations

from typing import Any, Callable, Iterable, NamedTuple

import bpy

from . import bake_losses

KINDS = {"MESH", "CURVE", "SURFACE", "FONT", "META"}

# Reports names of materials that are not baked, and the reason.
Fail = Callable[[list[str], str], None]


class Job(NamedTuple):
    """An object, and the values to bake of each of its materials, by their index; None for all."""

    item: bpy.types.Object
    lost: dict[int, set[str] | None]


def find_jobs(settings: dict[str, Any], fail: Fail) -> list[Job]:
    """Returns the objects with materials that need it."""
    graph = bpy.context.evaluated_depsgraph_get()
    items, instancers = {}, set()
    for instance in graph.object_instances:
        item = instance.object.original
        items.setdefault(item.name_full, item)
        # Curves, texts and metaballs are the parents of their own meshes.
        if instance.is_instance and instance.parent is not None and instance.parent.original != item:
            instancers.add(instance.parent.original.name_full)
    found = []
    known: dict[str, set[str] | None] = {}
    for name in sorted(items):
        item = items[name]
        if item.type not in KINDS:
            continue
        lost = {}
        for slot, material in enumerate(final_materials(item, graph, settings)):
            if material is None:
                continue
            if material.name_full not in known:
                known[material.name_full] = bake_losses.lost_values(material)
            values = known[material.name_full]
            if values is None or values:
                lost[slot] = values
        if not lost or not is_exported(item, settings):
            continue
        reason = obstacle(item, name in instancers, settings)
        if reason is None:
            found.append(Job(item, lost))
        else:
            fail([material.name for material in materials_of(item, lost)], reason)
    return found


def is_exported(item: bpy.types.Object, settings: dict[str, Any]) -> bool:
    """Returns True for an object that the exporter's options keep."""
    is_left_out = settings["gltf_selected"] and not item.select_get()
    if is_left_out and item.name in bpy.context.view_layer.objects:
        return False
    return not (settings["gltf_renderable"] and item.hide_render)


def obstacle(item: bpy.types.Object, is_instancer: bool, settings: dict[str, Any]) -> str | None:
    """Returns why an object cannot have another mesh; None if it can."""
    if item.particle_systems or is_instancer:
        return f"'{item.name}' makes instances"
    if not can_change(item) and settings["gltf_skins"] and any(m.type == "ARMATURE" for m in item.modifiers):
        return f"'{item.name}' belongs to another file and has an armature"
    return None


def can_change(item: bpy.types.Object) -> bool:
    """Returns True for an object of this file that can have another mesh."""
    is_linked = item.library is not None or item.override_library is not None
    return item.type == "MESH" and not is_linked and item.data.library is None


def materials_of(item: bpy.types.Object, lost: Iterable[int]) -> list[bpy.types.Material]:
    """Returns the materials of an object that are to be baked."""
    slots = item.material_slots
    return [slots[i].material for i in lost if i < len(slots) and slots[i].material is not None]


def final_materials(
    item: bpy.types.Object, graph: bpy.types.Depsgraph, settings: dict[str, Any]
) -> list[bpy.types.Material | None]:
    """Returns the materials that an object is exported with."""
    own = [slot.material for slot in item.material_slots]
    if item.type == "MESH" and settings["gltf_apply"] and item.modifiers:
        evaluated = item.evaluated_get(graph)
        # Geometry nodes may add some.
        added = [m and m.original for m in evaluated.data.materials[len(own) :]]
        return own + added
    return own
