"""f3d 4 by its library: a scene turned once around in steps. One OpenGL sample, no shadows:
`turn_f3d.py SCENE OUT COUNT`, where pictures lie beside OUT and the last is OUT."""

import sys
from pathlib import Path

import f3d

scene, out, count = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
engine = f3d.Engine.create_egl()
engine.scene.add(scene)
engine.window.size = 1280, 720
for frame in range(1, count + 1):
    last = frame == count
    engine.window.render_to_image().save(str(out if last else out.with_name(f"f3d-{frame:04}.png")))
    engine.window.camera.azimuth(360 / count)
