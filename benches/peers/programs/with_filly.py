"""Filament on llvmpipe by filly: `with_filly.py SCENE.glb OUT [shadows]`."""

import sys

import filly
from PIL import Image

with filly.Renderer() as renderer:
    scene = renderer.create_scene()
    scene.shadows = "shadows" in sys.argv[3:]
    scene.load(sys.argv[1])
    scene.camera = camera = renderer.create_camera()
    camera.set_perspective(fov_y_deg=42, near=0.01, far=100)
    camera.position = (0.62, 0.42, 1.75)
    camera.look_at((0, 0, 0))
    light = scene.add_directional_light(direction=(-0.5, -0.75, -0.43))
    light.casts_shadows = scene.shadows
    target = renderer.create_render_target(width=1280, height=720)
    renderer.render(scene, target)
    renderer.finish()
    Image.fromarray(target.read()).convert("RGB").save(sys.argv[2], compress_level=1)
