"""The state that pictures are rendered in, for exporters, which see what the viewport shows."""

from __future__ import annotations

import bpy


def show_what_renders(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
    """Gives the viewport the visibility, modifiers and levels of detail of renders. Changes the open file."""
    show_collections(view_layer)
    for item in scene.objects:
        # Cameras work although they are hidden.
        is_rendered = not item.hide_render or item.type == "CAMERA"
        set_if_editable(item, "hide_viewport", not is_rendered)
        if item.name in view_layer.objects:
            item.hide_set(not is_rendered, view_layer=view_layer)
        set_if_editable(item, "show_instancer_for_viewport", item.show_instancer_for_render)
        for modifier in item.modifiers:
            use_render_levels(modifier)
    for curve in bpy.data.curves:
        if curve.render_resolution_u > 0:
            set_if_editable(curve, "resolution_u", curve.render_resolution_u)
        if curve.render_resolution_v > 0:
            set_if_editable(curve, "resolution_v", curve.render_resolution_v)
    for ball in bpy.data.metaballs:
        set_if_editable(ball, "resolution", ball.render_resolution)
    render = scene.render
    render.simplify_subdivision = render.simplify_subdivision_render
    view_layer.update()


def show_collections(view_layer: bpy.types.ViewLayer) -> None:
    """Shows the collections that render, and hides the others."""
    waiting = [view_layer.layer_collection]
    while waiting:
        layer = waiting.pop()
        layer.hide_viewport = False
        # The root is the scene's own, which nothing hides.
        if layer is not view_layer.layer_collection:
            set_if_editable(layer.collection, "hide_viewport", layer.collection.hide_render)
        waiting.extend(layer.children)


def use_render_levels(modifier: bpy.types.Modifier) -> None:
    """Shows a modifier where it renders, with its subdivisions of renders."""
    set_if_editable(modifier, "show_viewport", modifier.show_render)
    if modifier.type in {"SUBSURF", "MULTIRES"}:
        set_if_editable(modifier, "levels", modifier.render_levels)


def set_if_editable(owner: bpy.types.bpy_struct, name: str, value: object) -> None:
    """Sets a property that differs. Data of other files keeps its own, as in Blender."""
    if getattr(owner, name) == value:
        return
    try:
        setattr(owner, name, value)
    except AttributeError:
        pass
