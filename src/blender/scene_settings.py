"""Render settings of a scene, as its ``extras.blinn``."""

from __future__ import annotations

from typing import Any

import bpy

from . import engine_settings

VERSION = 1
LIGHT_UNITS = {"SPEC": "standard", "COMPAT": "unitless", "RAW": "raw"}


def extras(scene: bpy.types.Scene, current_frame: int, settings: dict[str, Any]) -> dict[str, Any]:
    """Returns picture size, region, frames, view transform, light paths and film."""
    return {
        "version": VERSION,
        **picture(scene.render),
        "frames": frames(scene, current_frame),
        "view": view(scene),
        "filmTransparent": scene.render.film_transparent,
        **light_paths(scene),
        "lightUnits": LIGHT_UNITS.get(settings["gltf_lighting_mode"], "standard"),
    }

def picture(render: bpy.types.RenderSettings) -> dict[str, Any]:
    """Returns size in pixels, the percentage of it that is rendered, width / height of a pixel, and region.

    The region is in fractions of the picture, from its lower left corner.
    """
    values: dict[str, Any] = {
        "resolution": [render.resolution_x, render.resolution_y],
        "percentage": render.resolution_percentage,
        "pixelAspect": render.pixel_aspect_x / render.pixel_aspect_y,
    }
    if render.use_border:
        values["region"] = {
            "min": [render.border_min_x, render.border_min_y],
            "max": [render.border_max_x, render.border_max_y],
        }
    return values


def frames(scene: bpy.types.Scene, current_frame: int) -> dict[str, Any]:
    """Returns the frame range, the current frame, and frames per second. Frame N is at N / rate seconds."""
    return {
        "start": scene.frame_start,
        "end": scene.frame_end,
        "step": scene.frame_step,
        "current": current_frame,
        "rate": scene.render.fps / scene.render.fps_base,
    }


def view(scene: bpy.types.Scene) -> dict[str, Any]:
    """Returns view transform and look by name, exposure in stops, and gamma."""
    settings = scene.view_settings
    values: dict[str, Any] = {
        "transform": settings.view_transform,
        "exposure": settings.exposure,
        "gamma": settings.gamma,
    }
    if settings.look not in {"", "None"}:
        values["look"] = settings.look
    if scene.render.engine == "CYCLES":
        values["filmExposure"] = scene.cycles.film_exposure
    return values


def light_paths(scene: bpy.types.Scene) -> dict[str, Any]:
    """Returns the number of diffuse bounces and True for caustics, of the engines that have them."""
    if scene.render.engine == "CYCLES":
        cycles = scene.cycles
        return {
            "indirect": min(cycles.diffuse_bounces, cycles.max_bounces),
            "caustics": cycles.caustics_reflective or cycles.caustics_refractive,
        }
    if scene.render.engine == engine_settings.ENGINE:
        return engine_settings.light_paths(scene)
    eevee = getattr(scene, "eevee", None)
    if scene.render.engine.startswith("BLENDER_EEVEE") and getattr(eevee, "use_raytracing", False):
        return {"indirect": 1, "caustics": False}
    return {}
