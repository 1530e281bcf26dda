"""Objects and effects of renders that glTF has no form for."""

from __future__ import annotations

import bpy

from .engine_settings import ENGINE
from .material_loss import listed

# What objects of a type hold.
KINDS = {
    "CURVES": "hair",
    "VOLUME": "volumes",
    "POINTCLOUD": "point clouds",
    "GREASEPENCIL": "grease pencil",
    "GPENCIL": "grease pencil",
}
# Nodes of compositors that change no pixel.
PLAIN_NODES = {
    *("CompositorNodeRLayers", "CompositorNodeComposite", "CompositorNodeViewer", "NodeReroute", "NodeFrame"),
    *("NodeGroupInput", "NodeGroupOutput"),
}


def losses(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> list[str]:
    """Returns a sentence for each kind of what renders show and files do not."""
    found: dict[str, list[str]] = {}
    for item in layer.objects:
        if not is_rendered(item):
            continue
        if item.type in KINDS:
            found.setdefault(KINDS[item.type], []).append(f"'{item.name}'")
        elif any(is_hair(system) for system in item.particle_systems):
            found.setdefault("hair", []).append(f"'{item.name}'")
    texts = [f"{kind} of {len(names)} object(s) cannot be written: {listed(names)}" for kind, names in found.items()]
    return texts + [f"{effect} is not written" for effect in effects(scene)]


def is_rendered(item: bpy.types.Object) -> bool:
    """Returns True for an object that pictures show."""
    return not item.hide_render and not all(collection.hide_render for collection in item.users_collection)


def is_hair(system: bpy.types.ParticleSystem) -> bool:
    """Returns True for particles that are rendered as strands."""
    return system.settings.type == "HAIR" and system.settings.render_type == "PATH"


def effects(scene: bpy.types.Scene) -> list[str]:
    """Returns what changes whole pictures. The render engine of this package leaves it to Blender."""
    render = scene.render
    if render.engine == ENGINE:
        return []
    found = []
    if render.use_motion_blur:
        found.append("motion blur")
    if render.use_freestyle:
        found.append("Freestyle")
    if scene.view_settings.use_curve_mapping:
        found.append("the curve mapping of the view")
    if getattr(scene.view_settings, "use_white_balance", False):  # From Blender 4.3 on.
        found.append("white balance")
    # Under another name before Blender 5.0, where a switch enables it.
    tree = getattr(scene, "compositing_node_group", None)
    if bpy.app.version < (5, 0, 0) and scene.use_nodes:
        tree = scene.node_tree
    if render.use_compositing and tree is not None and any(n.bl_idname not in PLAIN_NODES for n in tree.nodes):
        found.append("the compositor")
    return found
