"""Exports a .blend file with the extension, and renders it by the engine, in a Python that has bpy.

    blend_in_blender.py SCENE.blend FOLDER SAMPLES

Writes scene.glb, engine.exr and version.txt into FOLDER.
"""
import sys
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[1]
MODULE = "blinn_extension"


def main():
    blend, folder, samples = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    sys.dont_write_bytecode = True
    addons = folder / "addons"
    addons.mkdir()
    (addons / MODULE).symlink_to(ROOT / "src/blender", target_is_directory=True)
    sys.path.insert(0, str(addons))
    import addon_utils

    bpy.ops.wm.open_mainfile(filepath=str(blend), load_ui=False)
    assert addon_utils.enable("io_scene_gltf2") is not None
    assert addon_utils.enable(MODULE, default_set=True) is not None
    # The checklist of docs/how-to/blender-extension.md.
    bpy.ops.export_scene.gltf(
        filepath=str(folder / "scene.glb"),
        export_format="GLB",
        export_cameras=True,
        export_lights=True,
        use_renderable=True,
        export_apply=True,
        export_gn_mesh=True,
    )
    scene = bpy.context.scene
    scene.render.engine = "BLINN"
    scene.blinn.samples = samples
    bpy.ops.render.render()
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    bpy.data.images["Render Result"].save_render(str(folder / "engine.exr"), scene=scene)
    (folder / "version.txt").write_text(bpy.app.version_string)


main()
