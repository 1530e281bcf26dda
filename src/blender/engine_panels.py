"""Panels of the render engine, and the panels of Blender that it shares."""

from __future__ import annotations

from typing import Iterator

import bpy

from .engine_settings import ENGINE, PROPERTY

# Panels of other engines for data that blinn reads.
SHARED_WITH_EEVEE = {
    "DATA_PT_EEVEE_light",
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_WORLD_PT_surface",
    "MATERIAL_PT_preview",
    "VIEWLAYER_PT_layer_passes_cryptomatte",
}
# Panels of Blender's former renderer, which blinn has no use for.
EXCLUDED = {"VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes", "RENDER_PT_simplify_greasepencil"}


class EnginePanel:
    """A panel of the properties editor that the render engine has for itself."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    COMPAT_ENGINES = {ENGINE}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES

    def begin(self) -> bpy.types.UILayout:
        """Returns the layout, set up for properties with their names on the left."""
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        return self.layout


class RENDER_PT_blinn(EnginePanel, bpy.types.Panel):
    bl_label = "Sampling"
    bl_context = "render"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.begin()
        settings = getattr(context.scene, PROPERTY)
        for name in ["samples", "denoise"]:
            layout.prop(settings, name)
        column = layout.column(align=True)
        for name in ["indirect", "bounces", "caustics"]:
            column.prop(settings, name)
        layout.prop(context.scene.render, "film_transparent")
        row = layout.row(heading="Limit Memory")
        row.prop(settings, "limit_memory", text="")
        column = row.column()
        column.active = settings.limit_memory
        column.prop(settings, "memory", text="")


class RENDER_PT_blinn_materials(EnginePanel, bpy.types.Panel):
    bl_label = "Materials"
    bl_context = "render"

    def draw(self, context: bpy.types.Context) -> None:
        draw_bake(self.begin(), context.scene)


class VIEWLAYER_PT_blinn_passes(EnginePanel, bpy.types.Panel):
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context: bpy.types.Context) -> None:
        column = self.begin().column(align=True)
        for name in ["z", "position", "normal", "object_index", "material_index"]:
            column.prop(context.view_layer, f"use_pass_{name}")


CLASSES = [RENDER_PT_blinn, RENDER_PT_blinn_materials, VIEWLAYER_PT_blinn_passes]


def draw_bake(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draws the settings of baking."""
    settings = getattr(scene, PROPERTY)
    layout.prop(settings, "bake")
    row = layout.row()
    row.active = settings.bake != "never"
    row.prop(settings, "bake_size")


def shared_panels() -> Iterator[type]:
    """Returns the panels of Blender that show settings which blinn uses."""
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if isinstance(engines, set) and panel.__name__ not in EXCLUDED:
            if "BLENDER_RENDER" in engines or panel.__name__ in SHARED_WITH_EEVEE:
                yield panel


def register() -> None:
    for panel in CLASSES:
        bpy.utils.register_class(panel)
    for panel in shared_panels():
        panel.COMPAT_ENGINES.add(ENGINE)


def unregister() -> None:
    for panel in shared_panels():
        panel.COMPAT_ENGINES.discard(ENGINE)
    for panel in reversed(CLASSES):
        bpy.utils.unregister_class(panel)
