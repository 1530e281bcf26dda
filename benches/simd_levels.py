#!/usr/bin/env python3
"""Measures whole frames at each SIMD level that the processor has, and prints their ratios.

    simd_levels.py BLINN [--suite 70k] [--models tower,figure] [--rounds 5] [--size 640x360] [--threads 1]

Levels take turns, scene by scene and round by round, in an order that is turned each round. Times are those of the stage
`frame` of `blinn bench`, relative to its calibration loop, so that a slow phase of the machine affects all levels alike.
Frames of different bytes are an error.
"""
import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), ".."))
# As the variable BLINN_SIMD takes them, from the narrowest to the widest.
LEVELS = ["portable", "avx2", "avx512"]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("blinn", help="the program")
    parser.add_argument("--suite", default="70k", metavar="SIZES", help="triangles of the generated scenes; none: no scenes")
    parser.add_argument("--models", default="figure,still-life,tower,textured", metavar="NAMES",
                        help="folders of models/; none: no models")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--samples", default="4")
    parser.add_argument("--threads", default="1")
    parser.add_argument("--min-time", default="0.2", metavar="SECONDS")
    return parser.parse_args()


def model_files(names):
    """The scene of each folder of models/."""
    files = []
    for name in [] if names == "none" else names.split(","):
        folder = os.path.join(ROOT, "models", name)
        paths = [os.path.join(folder, name + extension) for extension in (".glb", ".gltf", ".obj")]
        found = [path for path in paths if os.path.exists(path)]
        if not found:
            sys.exit(f"{folder}: there is no {name}.glb, .gltf or .obj")
        files.append(found[0])
    return files


def bench(args, scene, level, file):
    """Measures frames at a level. Returns the results, or None if the processor lacks the level."""
    command = [args.blinn, "bench", *scene, "--stages", "frame", "--rounds", "1", "--size", args.size,
               "--samples", args.samples, "--threads", args.threads, "--min-time", args.min_time, "--json", file, "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "BLINN_SIMD": level})
    if done.returncode != 0:
        if "BLINN_SIMD" in done.stderr:
            return None
        sys.exit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr}")
    with open(file, encoding="utf-8") as text:
        return json.load(text)


def measure(args):
    """Returns the times of each scene, thread count and level in all rounds, and the machine."""
    items = [[path] for path in model_files(args.models)]
    if args.suite != "none":
        items.append([f"--suite={args.suite}"])
    times, hashes, missing, machine = {}, {}, set(), {}
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(args.rounds):
            for item in items:
                levels = [level for level in LEVELS if level not in missing]
                start = turn % len(levels)
                for level in levels[start:] + levels[:start]:
                    print(f"round {turn + 1} of {args.rounds}: {os.path.basename(item[0])}, {level}", file=sys.stderr)
                    results = bench(args, item, level, os.path.join(folder, "results.json"))
                    if results is None:
                        print(f"this processor has no {level}", file=sys.stderr)
                        missing.add(level)
                        continue
                    machine = results["machine"]
                    for scene in results["scenes"]:
                        for stage in scene["stages"]:
                            name = (os.path.basename(scene["name"]), stage["threads"])
                            if hashes.setdefault(name, stage["hash"]) != stage["hash"]:
                                sys.exit(f"{name[0]}: the frame of {level} has other pixels than that of another level")
                            times.setdefault(name, {}).setdefault(level, []).append(
                                (stage["relative"][0], stage["seconds"][0]))
    return times, machine


def table(times, args, machine):
    """Returns a Markdown table: milliseconds, and the ratios of each level to the next narrower one."""
    levels = [level for level in LEVELS if any(level in found for found in times.values())]
    pairs = list(zip(levels, levels[1:]))
    head = ["scene", "threads", *(f"{level}, ms" for level in levels), *(f"{b} / {a}" for a, b in pairs)]
    lines = [f"{machine.get('cpu', '')} ({machine.get('cpu_model', '')}), frames of {args.size} pixels, {args.samples} samples "
             f"per pixel, medians of {args.rounds} rounds", "", "| " + " | ".join(head) + " |",
             "|" + "|".join(["---"] + ["---:"] * (len(head) - 1)) + "|"]
    ratios = {pair: [] for pair in pairs}
    for (scene, threads), found in times.items():
        relative = {level: statistics.median(relative for relative, _ in found[level]) for level in levels}
        cells = [scene, str(threads)]
        cells += [f"{1e3 * statistics.median(seconds for _, seconds in found[level]):.2f}" for level in levels]
        for a, b in pairs:
            ratios[a, b].append(relative[b] / relative[a])
            cells.append(f"{ratios[a, b][-1]:.3f}")
        lines.append("| " + " | ".join(cells) + " |")
    means = [f"{statistics.geometric_mean(ratios[pair]):.3f}" for pair in pairs]
    lines.append("| " + " | ".join(["geometric mean", "", *("" for _ in levels), *means]) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    options = arguments()
    measured, host = measure(options)
    print(table(measured, options, host))
