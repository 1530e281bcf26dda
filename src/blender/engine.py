"""The render engine: exports the scene, renders it with blinn's Python module, and returns linear light."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path
from typing import Any

import bpy
import numpy

from . import engine_export, engine_passes, engine_settings
from .engine_viewport import Viewport

# Part of the progress that the export takes.
EXPORT_SHARE = 0.1


class Cancelled(Exception):
    """The user cancelled the render."""


class BlinnRenderEngine(bpy.types.RenderEngine):
    """Renders final pictures, and previews in viewports whose shading is Rendered. EEVEE draws Material Preview."""

    bl_idname = engine_settings.ENGINE
    bl_label = "blinn"
    bl_use_preview = False
    bl_use_postprocess = True
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False

    def update_render_passes(self, scene: bpy.types.Scene = None, renderlayer: bpy.types.ViewLayer = None) -> None:
        """Tells the compositor which passes a view layer has."""
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        for wanted in engine_passes.passes_of(renderlayer):
            self.register_pass(scene, renderlayer, wanted.name, len(wanted.channels), wanted.channels, wanted.kind)

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Takes up changes of the scene for a viewport."""
        viewport = getattr(self, "viewport", None)
        if viewport is None:
            try:
                import blinn
            except ImportError as error:
                self.update_stats("", f"Python's module blinn is missing: {error}")
                return
            viewport = self.viewport = Viewport(self, blinn)
        viewport.update(depsgraph)

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Draws a viewport."""
        viewport = getattr(self, "viewport", None)
        if viewport is not None:
            viewport.draw(context, depsgraph)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Renders a view layer at the current frame."""
        try:
            import blinn
        except ImportError as error:
            self.fail(f"Python's module blinn is missing: {error}; build the extension's zip with `just blender`")
            return
        try:
            with tempfile.TemporaryDirectory(prefix="blinn-", ignore_cleanup_errors=True) as folder:
                self.render_in(blinn, depsgraph, Path(folder))
        except Cancelled:
            pass
        except (engine_export.ExportError, blinn.Error, ValueError, OSError) as error:
            self.fail(str(error))

    def render_in(self, blinn: Any, depsgraph: bpy.types.Depsgraph, folder: Path) -> None:
        """Renders a view layer with temporary files in ``folder``."""
        scene, view_layer = depsgraph.scene, depsgraph.view_layer
        self.update_stats("", "Exporting")
        exported = engine_export.export(depsgraph, folder, self.is_cancelled)
        if exported is None:
            raise Cancelled
        for warning in exported.warnings:
            self.report({"WARNING"}, warning)
        self.update_stats("", "Rendering")
        with warnings.catch_warnings(record=True) as issued:
            warnings.simplefilter("always")
            loaded = blinn.load(exported.glb, **engine_settings.load_options(scene))
            picture = loaded.render(
                layers=engine_passes.layers_of(view_layer),
                progress=self.follow,
                **engine_settings.render_options(scene),
            )
        for warning in issued:
            # Messages begin with the path of the temporary file.
            self.report({"WARNING"}, str(warning.message).removeprefix(f"{exported.glb}: "))
        self.write(picture, loaded, view_layer)

    def is_cancelled(self) -> bool:
        """Returns True once the user wants the render to end. Unlike Blender's own method, tests can replace it."""
        return self.test_break()

    def follow(self, fraction: float) -> None:
        """Shows the progress of blinn, and cancels it if the user wants that."""
        if self.is_cancelled():
            raise Cancelled
        self.update_progress(EXPORT_SHARE + (1.0 - EXPORT_SHARE) * fraction)

    def write(self, picture: Any, scene: Any, view_layer: bpy.types.ViewLayer) -> None:
        """Gives the passes of a view layer to Blender."""
        wanted = list(engine_passes.passes_of(view_layer))
        pixels = {w.name: engine_passes.pixels(w, picture, scene, view_layer) for w in wanted}
        pixels["Combined"] = picture.linear
        for matte in wanted:
            if matte.layer.startswith(engine_passes.CRYPTOMATTE):
                self.add_pass(matte.name, len(matte.channels), matte.channels, layer=view_layer.name)
        result = self.begin_result(0, 0, picture.width, picture.height, layer=view_layer.name)
        # Blender crashes if a result is never ended.
        try:
            for target in result.layers[0].passes:
                if target.name in pixels:
                    fill(target, pixels[target.name])
        finally:
            self.end_result(result)
        # Metadata of `result` would be lost with it.
        whole = self.get_result()
        for key, value in engine_passes.manifests(view_layer, scene):
            whole.stamp_data_add_field(key, value)

    def fail(self, reason: str) -> None:
        """Reports an error and ends the render."""
        self.report({"ERROR"}, f"blinn: {reason}")
        self.error_set(f"blinn: {reason}")


def fill(target: bpy.types.RenderPass, values: numpy.ndarray) -> None:
    """Sets the pixels of a pass, whose lowest row is first in Blender."""
    target.rect.foreach_set(numpy.ascontiguousarray(values[::-1], numpy.float32).ravel())


def register() -> None:
    bpy.utils.register_class(BlinnRenderEngine)


def unregister() -> None:
    bpy.utils.unregister_class(BlinnRenderEngine)
