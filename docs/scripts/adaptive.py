"""Measures `--adaptive`: the table of docs/explanation/antialiasing.md.

    python docs/scripts/adaptive.py BLINN            # needs numpy and OpenEXR

Prints the error against 1,024 samples, in display values (black 0, white 1), and the time of equal and of adaptive
sample counts, interleaved, medians of three.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR

MODELS = Path(__file__).resolve().parents[2] / "models"
SCENES = {
    "a room, few edges": "cornell/cornell.glb --size 160x160",
    "a still life, textured floor": "still-life/still-life.glb --size 240x135",
    "a gear train, many edges": "assembly/assembly.glb --size 240x135",
    "soft shadows and occlusion": "lecture/lecture.glb --size 240x135 --light-radius .5 --ao 16",
}
COUNTS = (16, 64)
THRESHOLDS = (0.02, 0.08, 0.16)


def picture(blinn, arguments, samples, seed=0, threshold=None):
    """Returns the picture in display values, and the render time in milliseconds."""
    scene, *flags = arguments.split()
    if threshold is not None:
        flags += ["--adaptive", threshold]
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "a.exr"
        command = [blinn, "render", MODELS / scene, "-o", out, "-s", samples, "--seed", seed, "-v", "--perf", *flags]
        log = subprocess.run([str(argument) for argument in command], check=True, capture_output=True, text=True).stderr
        with OpenEXR.File(str(out), separate_channels=True) as file:
            light = np.stack([file.channels()[c].pixels.astype(float) for c in "RGB"], -1)
    stops = re.search(r"--exposure (\S+)", log)
    light = np.clip(light * 2 ** float(stops.group(1) if stops else 0), 0, 1)
    time = float(re.search(r"perf: render +(\S+) ms", log).group(1))
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055), time


def error(a, b):
    return float(np.sqrt(np.mean((a - b) ** 2)))


def percentile(a, b):
    """Returns the 99.9th percentile of the pixels' errors."""
    return float(np.quantile(np.abs(a - b).max(-1), 0.999))


def main(blinn):
    print("| scene | samples | threshold | error | 99.9th percentile | time relative to all samples |\n|---|---|---|---|---|---|")
    for name, arguments in SCENES.items():
        reference, _ = picture(blinn, arguments, 1024, seed=9)
        for count in COUNTS:
            rounds = [
                {t: picture(blinn, arguments, count, threshold=t) for t in (None, *THRESHOLDS)} for _ in range(3)
            ]
            time = {t: np.median([r[t][1] for r in rounds]) for t in (None, *THRESHOLDS)}
            for threshold, (image, _) in rounds[0].items():
                print(
                    f"| {name} | {count} | {threshold or 'all'} | {error(image, reference):.4f} "
                    f"| {percentile(image, reference):.3f} | {time[threshold] / time[None]:.2f} |",
                    flush=True,
                )


if __name__ == "__main__":
    main(sys.argv[1])
