"""f3d 4 by its library: 12 views of each file, one OpenGL sample, no shadows: `objects_f3d.py LIST FOLDER SIDE`."""

import sys
from pathlib import Path

import f3d

files, folder, side = Path(sys.argv[1]).read_text().split(), Path(sys.argv[2]), int(sys.argv[3])
engine = f3d.Engine.create_egl()
engine.window.size = side, side
for file in files:
    engine.scene.clear()
    engine.scene.add(file)
    camera = engine.window.camera
    camera.reset_to_bounds()
    camera.elevation(22)
    for view in range(12):
        engine.window.render_to_image().save(str(folder / f"{Path(file).stem}-{view + 1:02}.png"))
        camera.azimuth(30)
