"""Settings of the render engine, stored with the scene."""

from __future__ import annotations

from typing import Any

import bpy

ENGINE = "BLINN"
PROPERTY = "blinn"


class BlinnSettings(bpy.types.PropertyGroup):
    """How pictures are rendered."""

    samples: bpy.props.IntProperty(name="Samples", description="Samples per pixel", default=16, min=1, max=65536)
    indirect: bpy.props.IntProperty(
        name="Diffuse Bounces",
        description="Maximum diffuse bounces along a path; 0 for direct light only",
        default=4,
        min=0,
        max=64,
    )
    bounces: bpy.props.IntProperty(
        name="Reflections",
        description="Maximum reflections along a path, and three times as many surfaces of glass",
        default=4,
        min=0,
        max=64,
    )
    caustics: bpy.props.BoolProperty(
        name="Caustics", description="Light that reflective and refractive surfaces send to matte ones", default=False
    )
    denoise: bpy.props.EnumProperty(
        name="Denoise",
        description="The noisy light that is reconstructed",
        items=[
            ("auto", "Automatic", "Where it is safe"),
            ("on", "On", "All noisy light"),
            ("off", "Off", "None"),
        ],
        default="auto",
    )
    limit_memory: bpy.props.BoolProperty(
        name="Limit Memory", description="Refuse scenes that need more memory", default=False
    )
    memory: bpy.props.IntProperty(
        name="Memory", description="Largest memory of a scene, in MiB", default=8192, min=64, soft_max=1 << 18
    )
    bake: bpy.props.EnumProperty(
        name="Bake",
        description="Nodes of materials that glTF cannot hold",
        items=[
            ("never", "Never", "Leave them out, with a warning"),
            ("auto", "Automatic", "Bake them to images, with Cycles"),
        ],
        default="never",
    )
    bake_size: bpy.props.IntProperty(
        name="Image Size", description="Texels on a side of baked images", default=1024, min=64, max=4096
    )


def register() -> None:
    bpy.utils.register_class(BlinnSettings)
    setattr(bpy.types.Scene, PROPERTY, bpy.props.PointerProperty(type=BlinnSettings))


def unregister() -> None:
    delattr(bpy.types.Scene, PROPERTY)
    bpy.utils.unregister_class(BlinnSettings)


def light_paths(scene: bpy.types.Scene) -> dict[str, Any]:
    """Returns what ``extras.blinn`` holds of the settings."""
    settings = getattr(scene, PROPERTY)
    return {"indirect": settings.indirect, "caustics": settings.caustics}


def load_options(scene: bpy.types.Scene) -> dict[str, Any]:
    """Returns options of ``blinn.load``."""
    settings = getattr(scene, PROPERTY)
    return {"max_memory": settings.memory << 20} if settings.limit_memory else {}


def render_options(scene: bpy.types.Scene) -> dict[str, Any]:
    """Returns options of ``blinn.Scene.render``."""
    settings = getattr(scene, PROPERTY)
    return {"samples": settings.samples, "bounces": settings.bounces, "denoise": settings.denoise}
