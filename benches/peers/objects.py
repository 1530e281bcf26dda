"""Compares renderers on many small objects: `just bench-peers objects`.

Each program is one process that renders 12 views of 512 x 512 pixels of textured GLB files of 1,000 to 50,000 triangles, one
sample. Prints medians of interleaved rounds: objects per second and core, CPU seconds and peak memory. Programs that are not
installed are skipped with a message.
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys

from peers import BLINN, PROGRAMS, PYTHON, SCENES, WORK, blender_python, has, install, measure_process

VIEWS = 12
FOLDER = SCENES / "objects"


def programs(only, side):
    """name: (shadows, command of (list, folder))."""
    def script(name, *rest, python=PYTHON):
        return lambda files, folder: [python, PROGRAMS / name, files, folder, side, *rest]

    def blinn(*flags):
        return lambda files, folder: [BLINN, "turntable", f"@{files}", "--count", VIEWS, "--size", f"{side}x{side}",
                                      "-s", "1", "-q", "-o", folder / "{stem}-##.png", *flags]

    f3d, mitsuba, bpy = has("f3d"), has("mitsuba"), blender_python()
    rows = {
        "blinn": (True, blinn()),
        # As much as Mitsuba and Cycles do.
        "blinn with a sun": (True, blinn("--lights", "none", "--sun=-3,-4,-2,2", "--bounces", "0")),
        "f3d": (False, script("objects_f3d.py") if f3d else None),
        "Mitsuba llvm": (True, script("objects_mitsuba.py", "llvm_ad_rgb") if mitsuba else None),
        "Mitsuba scalar": (True, script("objects_mitsuba.py", "scalar_rgb") if mitsuba else None),
        "Workbench": (False, script("objects_bpy.py", "BLENDER_WORKBENCH", python=bpy) if bpy else None),
        "Cycles": (True, script("objects_bpy.py", "CYCLES", python=bpy) if bpy else None),
    }
    missing = [name for name, (_, command) in rows.items() if command is None]
    if missing:
        print(f"!! NOT INSTALLED, SKIPPED: {', '.join(missing)} (f3d, mitsuba: pip; BPY_PYTHON=a Python with bpy)",
              file=sys.stderr)
    return {name: row for name, row in rows.items() if row[1] and (not only or name in only)}


def run(command, files, count):
    """Returns (wall s, CPU s, peak MB) of a process that makes all pictures, or an error message."""
    folder = WORK / "objects"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    result = measure_process(command(files, folder))
    made = len(list(folder.glob("*.png")))
    if not isinstance(result, str) and made != count * VIEWS:
        return f"{made} of {count * VIEWS} pictures"
    return result


parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("objects", nargs="?", type=int, default=40)
parser.add_argument("--rounds", type=int, default=3)
parser.add_argument("--side", type=int, default=512, help="pixels")
parser.add_argument("--only", help="names of programs, separated by commas")
arguments = parser.parse_args()
install("f3d", "mitsuba", "PIL", "numpy")
subprocess.run([PYTHON, PROGRAMS / "make_objects.py", FOLDER, str(arguments.objects)], check=True)
listed = WORK / "objects.txt"
listed.write_text("".join(f"{FOLDER}/{i:05}.glb\n" for i in range(arguments.objects)))
installed = programs(arguments.only and arguments.only.split(","), arguments.side)
runs, broken = {}, set()
for turn in range(arguments.rounds):
    for program, (_, command) in installed.items():
        if program in broken:
            continue
        result = run(command, listed, arguments.objects)
        if isinstance(result, str):
            broken.add(program)
            print(f"!! {program}: SKIPPED, {result}", file=sys.stderr)
        else:
            runs.setdefault(program, []).append(result)
cores, rows = len(os.sched_getaffinity(0)), []
for program, results in runs.items():
    wall, cpu, peak = (statistics.median(column) for column in zip(*results))
    rate = arguments.objects / wall / cores
    rows.append({"program": program, "objects": arguments.objects, "shadows": installed[program][0], "wall": wall, "cpu": cpu,
                 "objects per second and core": rate, "peak MB": peak})
own = [next((row["wall"] for row in rows if row["program"] == name), None) for name in ("blinn", "blinn with a sun")]
print(f"\n{arguments.objects} objects, {VIEWS} views of {arguments.side} x {arguments.side}, {cores} cores, medians of "
      f"{arguments.rounds}\n\n| program | shadows | wall s | CPU s | objects per second and core | peak MB "
      "| blinn's wall time to it | with a sun |\n|---|---|---|---|---|---|---|---|")
for row in sorted(rows, key=lambda r: r["wall"]):
    ratio = " | ".join(f"{wall / row['wall']:.2f}" if wall else "" for wall in own)
    print(f"| {row['program']} | {'yes' if row['shadows'] else 'no'} | {row['wall']:.2f} | {row['cpu']:.2f} "
          f"| {row['objects per second and core']:.2f} | {row['peak MB']:.0f} | {ratio} |")
(WORK / "objects.json").write_text(json.dumps(rows, indent=1))
