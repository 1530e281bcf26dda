"""Blender extension of blinn: a render engine, and File > Export > glTF also writes what glTF has no field for."""

from __future__ import annotations

import bpy

from . import engine, engine_panels, engine_settings, journal
from .export_hook import ENABLED, glTF2_post_export_callback, glTF2_pre_export_callback, glTF2ExportUserExtension
from .import_hook import SCENE_SETTINGS, glTF2ImportUserExtension

__all__ = [
    "draw_import",
    "glTF2ExportUserExtension",
    "glTF2ImportUserExtension",
    "glTF2_post_export_callback",
    "glTF2_pre_export_callback",
    "register",
    "unregister",
]

PANEL = "blinn"
PARTS = [journal, engine_settings, engine, engine_panels]


def draw_export(context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
    """Draws the checkbox in the export dialog."""
    header, body = layout.panel("BLINN_export", default_closed=False)
    header.prop(context.scene, ENABLED, text="")
    header.label(text="blinn")
    if body is not None:
        body.active = getattr(context.scene, ENABLED)
        body.label(text="Area lights, world and render settings")
        engine_panels.draw_bake(body, context.scene)


def draw_import(context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
    """Draws the checkbox in the import dialog, which asks for a function of this name."""
    header, body = layout.panel("BLINN_import", default_closed=False)
    header.label(text="blinn")
    if body is not None:
        body.prop(context.scene, SCENE_SETTINGS)


def export_panels() -> dict:
    """Returns the panels of the exporter's dialog; an empty dictionary if the exporter is disabled."""
    try:
        from io_scene_gltf2 import exporter_extension_layout_draw
    except ImportError:
        return {}
    return exporter_extension_layout_draw


def register() -> None:
    enabled = bpy.props.BoolProperty(
        name="blinn",
        description="Also write area lights (EXT_lights_area), the world and render settings (extras.blinn)",
        default=True,
    )
    setattr(bpy.types.Scene, ENABLED, enabled)
    scene_settings = bpy.props.BoolProperty(
        name="World and Render Settings",
        description="Give the scene the world and the render settings of the file (extras.blinn)",
        default=False,
    )
    setattr(bpy.types.Scene, SCENE_SETTINGS, scene_settings)
    export_panels()[PANEL] = draw_export
    for part in PARTS:
        part.register()


def unregister() -> None:
    for part in reversed(PARTS):
        part.unregister()
    export_panels().pop(PANEL, None)
    delattr(bpy.types.Scene, ENABLED)
    delattr(bpy.types.Scene, SCENE_SETTINGS)
