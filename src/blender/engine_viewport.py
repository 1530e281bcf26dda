"""The render engine in viewports: draws pictures of a thread, and exports the scene again when it has changed."""

from __future__ import annotations

import tempfile
import time
import weakref
from pathlib import Path
from typing import Any

import bpy

from . import engine_export, engine_settings, viewport_camera
from .viewport_render import Export, Renderer, View

# Seconds between looks at the thread, and of rest before a change is exported.
PERIOD, REST = 0.02, 0.3


class Viewport:
    """The preview of one viewport."""

    def __init__(self, engine: bpy.types.RenderEngine, blinn: Any) -> None:
        self.engine = weakref.ref(engine)
        self.blinn = blinn
        self.renderer = Renderer(blinn)
        self.choice: list[str] = []
        self.settings: tuple[Any, ...] | None = None
        self.scene_name = ""
        self.changed_at = 0.0
        self.drawn = -1
        self.status = ""
        self.texture: Any = None
        bpy.app.timers.register(self.look)

    def update(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Notes that the scene has changed."""
        settings = settings_of(depsgraph)
        if self.settings == settings and not is_changed(depsgraph):
            return
        # The first export begins at once.
        self.changed_at = time.monotonic() - (REST if self.settings is None else 0.0)
        self.settings, self.scene_name = settings, depsgraph.scene.name
        self.choice = engine_export.choice_of(depsgraph)

    def look(self) -> float | None:
        """Starts exports, and redraws what is new. Returns the time to the next look; None at the end."""
        engine = self.engine()
        if engine is None or self.renderer.is_closed:
            self.renderer.close()
            return None
        try:
            # Raises ReferenceError if the viewport has ended.
            _ = engine.is_preview
            if self.changed_at and time.monotonic() - self.changed_at >= REST:
                self.changed_at = 0.0
                self.export()
            if self.renderer.count != self.drawn or self.renderer.status != self.status:
                self.status = self.renderer.status
                engine.update_stats("", self.status)
                engine.tag_redraw()
        except ReferenceError:
            self.renderer.close()
            return None
        return PERIOD

    def export(self) -> None:
        """Saves a copy of the scene, which the thread exports."""
        scene = bpy.data.scenes.get(self.scene_name)
        if scene is None:
            return
        folder = tempfile.TemporaryDirectory(prefix="blinn-", ignore_cleanup_errors=True)
        engine_export.save_copy(scene, Path(folder.name))
        options = engine_settings.load_options(scene), engine_settings.render_options(scene)
        self.renderer.replace_scene(Export(folder, self.choice, *options))

    def draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Draws the last picture, and asks for those of the present view."""
        import gpu
        from gpu_extras.presets import draw_texture_2d

        region, data = context.region, context.region_data
        view, projection, size = data.view_matrix.copy(), data.window_matrix.copy(), (region.width, region.height)
        key = (size, *(value for matrix in (view, projection) for row in matrix for value in row))
        make = lambda size: viewport_camera.camera(self.blinn, view, projection, size)  # noqa: E731
        self.renderer.show(View(make, key, size))
        with self.renderer.changed:
            picture, count = self.renderer.picture, self.renderer.count
        if picture is None:
            return
        if count != self.drawn:
            height, width = picture.shape[:2]
            texels = gpu.types.Buffer("FLOAT", picture.size, picture.ravel())
            self.texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=texels)
            self.drawn = count
        gpu.state.blend_set("ALPHA_PREMULT")
        self.engine().bind_display_space_shader(depsgraph.scene)
        draw_texture_2d(self.texture, (0, 0), *size)
        self.engine().unbind_display_space_shader()
        gpu.state.blend_set("NONE")


def settings_of(depsgraph: bpy.types.Depsgraph) -> tuple[Any, ...]:
    """Returns what pictures depend on beside the data of the scene."""
    scene = depsgraph.scene
    values = [engine_export.choice_of(depsgraph), scene.render.film_transparent, engine_settings.light_paths(scene)]
    return (*values, engine_settings.load_options(scene), engine_settings.render_options(scene))


def is_changed(depsgraph: bpy.types.Depsgraph) -> bool:
    """Returns True if pictures of the scene change, other than by its cameras, which a viewport has itself."""
    for update in depsgraph.updates:
        data = update.id
        if isinstance(data, bpy.types.Camera) or (isinstance(data, bpy.types.Object) and data.type == "CAMERA"):
            continue
        if isinstance(data, bpy.types.World) or update.is_updated_geometry or update.is_updated_transform:
            return True
        if update.is_updated_shading:
            return True
    return False
