"""Meshes of objects as the exporter sees them."""

from __future__ import annotations

from typing import Any

import bpy
import numpy

from .journal import Journal

# Modifiers that move points, and add none.
DEFORMING = {
    *("ARMATURE", "CAST", "CLOTH", "CORRECTIVE_SMOOTH", "CURVE", "DISPLACE", "HOOK", "LAPLACIANDEFORM", "LATTICE"),
    *("LAPLACIANSMOOTH", "MESH_CACHE", "MESH_DEFORM", "MESH_SEQUENCE_CACHE", "SHRINKWRAP", "SIMPLE_DEFORM", "SMOOTH"),
    *("SOFT_BODY", "SURFACE_DEFORM", "VOLUME_DISPLACE", "WARP", "WAVE"),
}


def evaluate(item: bpy.types.Object, settings: dict[str, Any], journal: Journal) -> tuple[bpy.types.Mesh, bool]:
    """Returns a new mesh, and True if modifiers are applied to it, as the exporter's options ask."""
    if item.type != "MESH":
        hidden = [] if settings["gltf_apply"] else list(item.modifiers)
        return journal.add(bpy.data.meshes, new_mesh(item, hidden)), True
    is_applied = settings["gltf_apply"] and any(applies(modifier, settings) for modifier in item.modifiers)
    if not is_applied:
        return journal.add(bpy.data.meshes, item.data.copy()), False
    mesh = journal.add(bpy.data.meshes, new_mesh(item, [m for m in item.modifiers if not applies(m, settings)]))
    # Of the mesh without modifiers, as generated coordinates have it.
    mesh.use_auto_texspace = False
    return mesh, True


def applies(modifier: bpy.types.Modifier, settings: dict[str, Any]) -> bool:
    """Returns True for a modifier that the exporter applies."""
    return modifier.type != "ARMATURE" or not settings["gltf_skins"]


def new_mesh(item: bpy.types.Object, hidden: list[bpy.types.Modifier], shapes: bool = True) -> bpy.types.Mesh:
    """Returns the mesh of an object without some of its modifiers, and its shape keys if that is asked for."""
    journal = Journal()
    try:
        for modifier in hidden:
            journal.set(modifier, "show_viewport", False)
        keys = getattr(item.data, "shape_keys", None)
        for key in [] if shapes or keys is None else keys.key_blocks:
            journal.set(key, "mute", True)
        graph = bpy.context.evaluated_depsgraph_get()
        evaluated = item.evaluated_get(graph)
        return bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=graph)
    finally:
        journal.restore()


def undeformed(
    item: bpy.types.Object, mesh: bpy.types.Mesh, settings: dict[str, Any], journal: Journal
) -> numpy.ndarray | None:
    """Returns the points of an evaluated mesh without deformations; None if they are those of the mesh."""
    if item.type != "MESH":
        return None
    hidden = [m for m in item.modifiers if not applies(m, settings) or m.type in DEFORMING]
    is_deformed = any(applies(m, settings) and m.show_viewport for m in hidden) or item.data.shape_keys is not None
    if mesh.use_auto_texspace or not is_deformed:
        return None
    other = journal.add(bpy.data.meshes, new_mesh(item, hidden, shapes=False))
    if len(other.vertices) != len(mesh.vertices):
        return None
    points = numpy.empty(3 * len(other.vertices), dtype=numpy.float32)
    other.vertices.foreach_get("co", points)
    return points


def deform(item: bpy.types.Object, rest: numpy.ndarray) -> None:
    """Keeps the shape of an object, and gives it the coordinates that generated textures have before deformations."""
    mesh = item.data
    shape = numpy.empty(3 * len(mesh.vertices), dtype=numpy.float32)
    mesh.vertices.foreach_get("co", shape)
    mesh.vertices.foreach_set("co", rest)
    item.shape_key_add(name="Rest", from_mix=False)
    key = item.shape_key_add(name="Shape", from_mix=False)
    key.data.foreach_set("co", shape)
    key.value = 1.0
    mesh.update()
