"""Makes every model again: `python models/scripts/build_all.py`, with a Python that has bpy 5.0.1.

Names (`build_all.py lecture tests`) select scenes. lecture, reconstruction and tests
need no Blender; the rest do. Each scene runs in its own process.
"""

import subprocess
import sys
from pathlib import Path

here = Path(__file__).resolve().parent
SCENES = ["cornell", "still_life", "bar", "assembly", "textured", "figure", "lecture", "alpha", "tower", "reconstruction", "tests"]

for name in sys.argv[1:] or SCENES:
    print(f"{name} …", flush=True)
    result = subprocess.run(
        [sys.executable, "-B", here / f"{name.replace('-', '_')}.py"],
        cwd=here,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    if result.returncode:
        sys.exit(f"{result.stdout}\n{name} failed")
subprocess.run([sys.executable, "-B", here / "check.py"], check=True)
