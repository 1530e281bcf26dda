"""Settings of Blender's glTF exporter for files that are rendered."""

from __future__ import annotations

from typing import Any

import bpy


def export_options(scene: bpy.types.Scene, is_still: bool) -> dict[str, Any]:
    """Returns arguments of ``bpy.ops.export_scene.gltf``."""
    is_animated = not is_still and has_animation(scene)
    # Applied modifiers turn shape keys into plain meshes, which lose their animation.
    options: dict[str, Any] = {
        "export_format": "GLB",
        "export_apply": not is_animated or has_modifiers(scene),
        "export_cameras": True,
        "export_lights": True,
        "export_gn_mesh": True,
        "export_import_convert_lighting_mode": "SPEC",
        "use_visible": True,
        "use_active_scene": True,
        "export_animations": is_animated,
        # Else objects are as at frame 0.
        "export_current_frame": not is_animated,
        "export_animation_mode": "SCENE",
        "export_anim_scene_split_object": False,
        "export_optimize_animation_size": True,
        # Keys of materials, lights and cameras.
        "export_pointer_animation": is_animated,
        "export_skins": is_animated,
        "export_morph": is_animated,
    }
    known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    return {name: value for name, value in options.items() if name in known}


def has_animation(scene: bpy.types.Scene) -> bool:
    """Returns True if something may move in the scene's frame range."""
    if scene.frame_start == scene.frame_end:
        return False
    if scene.rigidbody_world is not None and scene.rigidbody_world.enabled:
        return True
    owners: list[Any] = [scene, scene.world]
    for item in scene.objects:
        owners += [item, item.data, getattr(item.data, "shape_keys", None)]
        owners += [slot.material for slot in item.material_slots]
        owners += [slot.material.node_tree for slot in item.material_slots if slot.material]
    return any(is_driven(owner) for owner in owners if owner is not None)


def is_driven(owner: Any) -> bool:
    """Returns True for data with an action, strips or drivers."""
    data = getattr(owner, "animation_data", None)
    return data is not None and (data.action is not None or len(data.nla_tracks) > 0 or len(data.drivers) > 0)


def has_modifiers(scene: bpy.types.Scene) -> bool:
    """Returns True if a mesh has a modifier that glTF has no form for."""
    return any(m.type != "ARMATURE" and m.show_render for o in scene.objects for m in o.modifiers)
