"""Compares renderers from a scene file to an image of 1280 x 720: `just bench-peers programs`.

Prints medians of interleaved rounds: wall and CPU seconds, and peak memory of the process. Programs that are not
installed are skipped with a message. `--quick`: three rounds of the small files; `--only NAME`: one of the files.
`--turntable`: the 36 frames of one turn of the gear train instead.
"""

import argparse
import json
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

from peers import (BLINN, GENERATOR, PROGRAMS, PYTHON, ROOT, SCENES, WORK, blender_python, has, install,
                   measure_process)

FILES = {
    "scan-70k.obj": ("70k",), "scan-76k.glb": ("76k", "--textured"),
    "scan-1.1m.glb": ("1.1m", "--textured"), "scan-1.1m.obj": ("1.1m",),
}
VIEW = {".obj": ["--view-point", "0.62,0.42,1.75", "--look-at", "0,0,0", "--yfov", "42", "--lights", "none",
                 "--point-light", "3,4,2,30"], ".glb": []}


def set_up():
    """Installs the programs that pip has, and generates the scenes."""
    install("f3d", "mitsuba", "filly", "PIL")
    SCENES.mkdir(parents=True, exist_ok=True)
    made_by = GENERATOR.stat().st_mtime
    for name, (count, *flags) in FILES.items():
        stale = not (SCENES / name).exists() or (SCENES / name).stat().st_mtime < made_by
        if stale:
            subprocess.run([GENERATOR, "scan", count, SCENES / name, *flags], check=True)
        pov = (SCENES / name).with_suffix(".pov")
        if name.endswith(".obj") and (stale or not pov.exists()):
            subprocess.run([sys.executable, PROGRAMS / "obj_to_pov.py", SCENES / name, pov], check=True)


def programs(quick):
    """name: (files' endings, samples, shadows, command of (scene, picture)); None if it is not installed."""
    def script(name, *rest, python=PYTHON):
        return lambda scene, out: [python, PROGRAMS / name, scene, out, *rest]

    def blinn(*flags):
        return lambda scene, out: [BLINN, "render", scene, "-o", out, "--size", "1280x720", "-q", *flags,
                                   *VIEW[scene.suffix]]

    def viewer(scene, out):
        return ["viewer", "-i", scene, "-o", Path(out).with_suffix(".ppm"), "--size", "1280", "720",
                "--vp", "0.62", "0.42", "1.75", "--vi", "0", "0", "0", "--fov", "42"]

    def povray(scene, out):
        return ["povray", f"+I{scene.with_suffix('.pov')}", f"+O{out}", "+W1280", "+H720", "-D", "-A", "+WT2", "-GA", "-V"]

    both, obj, glb = (".obj", ".glb"), (".obj",), (".glb",)
    mitsuba, filly, bpy = has("mitsuba"), has("filly"), blender_python()
    rows = {
        "blinn": (both, 1, True, blinn("-s", "1")),
        "f3d": (both, 1, False, script("with_f3d.py") if has("f3d") else None),
        "filly": (glb, 1, False, script("with_filly.py") if filly else None),
        "filly, shadows": (glb, 1, True, script("with_filly.py", "shadows") if filly else None),
        "Embree's viewer": (obj, 1, False, viewer if shutil.which("viewer") else None),
        "POV-Ray": (obj, 1, True, povray if shutil.which("povray") else None),
        "Mitsuba scalar": (obj, 1, True, script("with_mitsuba.py", "1", "scalar_rgb") if mitsuba else None),
        "Mitsuba llvm": (obj, 1, True, script("with_mitsuba.py", "1", "llvm_ad_rgb") if mitsuba else None),
        "Cycles": (both, 1, True, script("with_cycles.py", "1", python=bpy) if bpy else None),
        "blinn, 16": (both, 16, True, blinn("-s", "16")),
        "Mitsuba llvm, 16": (obj, 16, True, script("with_mitsuba.py", "16", "llvm_ad_rgb") if mitsuba else None),
        "Mitsuba scalar, 16": (obj, 16, True, script("with_mitsuba.py", "16", "scalar_rgb") if mitsuba else None),
        "Cycles, 16": (both, 16, True, script("with_cycles.py", "16", python=bpy) if bpy else None),
    }
    return {k: v for k, v in rows.items() if not quick or v[1] == 1}


def run(command, out):
    """Returns (wall s, CPU s, peak MB) of a process, or an error message."""
    out.unlink(missing_ok=True)
    result = measure_process(command)
    if not isinstance(result, str) and not (out.exists() or out.with_suffix(".ppm").exists()):
        return "no picture"
    return result


def measure(name, rounds):
    scene = SCENES / name
    runs, broken = {}, {}
    for turn in range(rounds + 1):
        for program, (endings, _, _, command) in installed.items():
            if scene.suffix not in endings or program in broken:
                continue
            out = WORK / f"{name}-{''.join(c for c in program if c.isalnum())}.png"
            result = run(command(scene, out), out)
            if isinstance(result, str):
                broken[program] = result
                print(f"!! {program} on {name}: SKIPPED, {result}", file=sys.stderr)
            elif turn:  # The first round warms up files and caches.
                runs.setdefault(program, []).append(result)
    rows = []
    for program, results in runs.items():
        wall, cpu, peak = (statistics.median(column) for column in zip(*results))
        _, samples, shadows, _ = installed[program]
        rows.append({"file": name, "program": program, "samples": samples, "shadows": shadows, "wall": wall,
                     "cpu": cpu, "peak MB": peak})
    own = {row["samples"]: row for row in rows if row["program"].startswith("blinn")}
    print(f"\n### {name}, medians of {rounds}\n| program | samples | shadows | wall s | CPU s | peak MB "
          "| blinn's wall to it | blinn's CPU to it |\n|---|---|---|---|---|---|---|---|")
    for row in sorted(rows, key=lambda r: (r["samples"], r["wall"])):
        # In turntables the programs have different numbers of samples.
        mine = own.get(row["samples"]) or next(iter(own.values()), None)
        ratio = [f"{mine[k] / row[k]:.2f}" if mine else "" for k in ("wall", "cpu")]
        print(f"| {row['program']} | {row['samples']} | {'yes' if row['shadows'] else 'no'} | {row['wall']:.2f} "
              f"| {row['cpu']:.2f} | {row['peak MB']:.0f} | {ratio[0]} | {ratio[1]} |", flush=True)
    return rows


def turntables():
    """The programs for --turntable. The last frame shows that all were rendered."""
    def blinn(scene, out):
        shutil.rmtree(out.parent / "turn", ignore_errors=True)
        return ["bash", "-euc", '"$0" turntable "$1" -o "$2/turn/####.png" --size 1280x720 -q && mv "$2/turn/0036.png" "$3"',
                BLINN, scene, out.parent, out]

    def f3d(scene, out):
        return [PYTHON, PROGRAMS / "turn_f3d.py", scene, out, "36"]

    return {"blinn": ((".glb",), 4, True, blinn), "f3d": ((".glb",), 1, False, f3d if has("f3d") else None)}


parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--quick", action="store_true")
parser.add_argument("--rounds", type=int, default=5)
parser.add_argument("--only", choices=FILES)
parser.add_argument("--turntable", action="store_true")
arguments = parser.parse_args()
set_up()
installed = {}
for name, row in (turntables() if arguments.turntable else programs(arguments.quick)).items():
    if row[3] is None:
        print(f"!! {name}: NOT INSTALLED, SKIPPED (povray, embree-tools: Debian; f3d, mitsuba, filly: pip; "
              "Cycles: BPY_PYTHON=a Python with bpy)", file=sys.stderr)
    else:
        installed[name] = row
if arguments.turntable:
    SCENES = ROOT / "models/assembly"
    files = ["assembly.glb"]
else:
    files = [arguments.only] if arguments.only else [f for f in FILES if not arguments.quick or "1.1m" not in f]
figures = [row for name in files for row in measure(name, 3 if arguments.quick else arguments.rounds)]
(WORK / "programs.json").write_text(json.dumps(figures, indent=1))
