"""Lens shift and depth of field of a camera, as its ``extras.blinn``."""

from __future__ import annotations

from typing import Any

import bpy

MILLIMETRES = 1000.0


def extras(camera_object: bpy.types.Object) -> dict[str, Any]:
    """Returns what differs from a pinhole camera without shift."""
    values: dict[str, Any] = {}
    shift = lens_shift(camera_object.data, bpy.context.scene.render)
    if shift != [0.0, 0.0]:
        values["shift"] = shift
    if camera_object.data.dof.use_dof:
        values["depthOfField"] = depth_of_field(camera_object)
    return values


def lens_shift(camera: bpy.types.Camera, render: bpy.types.RenderSettings) -> list[float]:
    """Returns the shift to the right and up, in units of the larger side of the picture.

    Blender's unit is the side that the sensor is fitted to.
    """
    width = render.resolution_x * render.pixel_aspect_x
    height = render.resolution_y * render.pixel_aspect_y
    fitted = {"HORIZONTAL": width, "VERTICAL": height}.get(camera.sensor_fit, max(width, height))
    return [shift * fitted / max(width, height) for shift in (camera.shift_x, camera.shift_y)]


def depth_of_field(camera_object: bpy.types.Object) -> dict[str, Any]:
    """Returns focus distance and aperture radius in metres, and the shape of the aperture."""
    camera = camera_object.data
    dof = camera.dof
    radius = camera.lens / MILLIMETRES / (2.0 * dof.aperture_fstop)
    if camera.type == "ORTHO":
        radius = 1.0 / (2.0 * dof.aperture_fstop)
    return {
        "focusDistance": focus_distance(camera_object),
        "apertureRadius": radius,
        "blades": dof.aperture_blades,
        "rotation": dof.aperture_rotation,
        "ratio": dof.aperture_ratio,
    }


def focus_distance(camera_object: bpy.types.Object) -> float:
    """Returns the distance of the plane in focus along the view direction, in metres."""
    dof = camera_object.data.dof
    if dof.focus_object is None:
        return dof.focus_distance
    to_camera = camera_object.matrix_world.normalized().inverted_safe()
    return abs((to_camera @ dof.focus_object.matrix_world.translation).z)
