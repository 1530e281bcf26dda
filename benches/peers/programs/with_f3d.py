"""f3d 4 by its library: scene, picture. One OpenGL sample, no shadows: `with_f3d.py SCENE OUT`."""

import sys

import f3d

engine = f3d.Engine.create_egl()
engine.scene.add(sys.argv[1])
engine.window.size = 1280, 720
camera = engine.window.camera
camera.position, camera.focal_point, camera.view_up = (0.62, 0.42, 1.75), (0, 0, 0), (0, 1, 0)
camera.view_angle = 42
engine.window.render_to_image().save(sys.argv[2])
