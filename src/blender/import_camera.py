"""Cameras of files: what `camera` writes, the other way round."""

from __future__ import annotations

from typing import Any

import bpy

from .camera import MILLIMETRES
from .import_values import members, number, numbers, set_number


def read(item: bpy.types.Object, values: dict[str, Any], scene: bpy.types.Scene) -> None:
    """Gives a camera its lens shift and depth of field, and a scene without a camera the active one."""
    camera = item.data
    shift = numbers(values, "shift", 2)
    if shift is not None:
        render = scene.render
        width = render.resolution_x * render.pixel_aspect_x
        height = render.resolution_y * render.pixel_aspect_y
        fitted = {"HORIZONTAL": width, "VERTICAL": height}.get(camera.sensor_fit, max(width, height))
        camera.shift_x, camera.shift_y = (value * max(width, height) / fitted for value in shift)
    dof = members(values, "depthOfField")
    radius = number(dof, "apertureRadius", 1e-9)
    if radius is not None:
        camera.dof.use_dof = True
        camera.dof.aperture_fstop = (1.0 if camera.type == "ORTHO" else camera.lens / MILLIMETRES) / (2.0 * radius)
        set_number(camera.dof, "focus_distance", number(dof, "focusDistance", 0.0))
        camera.dof.aperture_blades = int(number(dof, "blades", 0, 16) or 0)
        set_number(camera.dof, "aperture_rotation", number(dof, "rotation"))
        set_number(camera.dof, "aperture_ratio", number(dof, "ratio", 0.01))
    if values.get("activeCamera") is True and scene.camera is None:
        scene.camera = item
