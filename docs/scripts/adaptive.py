"""What adaptive sampling could save: the table of docs/antialiasing.md.

    python docs/scripts/adaptive.py BLINN            # needs numpy and OpenEXR

Four samples everywhere, and sixteen more where a pixel's four differ from a neighbour's by more than a threshold (in
display values, black 0 and white 1). The error of that is compared with those of equal counts for all: the count of
theirs that has the same error, by interpolation, over the mean count here. What finding single pixels and tracing them
apart would cost is not counted, so this is the most that can be gained.
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
COUNTS = (4, 8, 12, 16, 20, 24, 32)
THRESHOLDS = (0.02, 0.08, 0.16)


def picture(blinn, words, samples, seed=0):
    scene, *flags = words.split()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "a.exr"
        command = [blinn, "render", MODELS / scene, "-o", out, "-s", samples, "--seed", seed, "-v", *flags]
        told = subprocess.run([str(w) for w in command], check=True, capture_output=True, text=True).stderr
        with OpenEXR.File(str(out), separate_channels=True) as file:
            light = np.stack([file.channels()[c].pixels.astype(float) for c in "RGB"], -1)
    stops = re.search(r"--exposure (\S+)", told)
    light = np.clip(light * 2 ** float(stops.group(1) if stops else 0), 0, 1)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def differs(image, threshold):
    """Where a pixel and one of its eight neighbours are apart."""
    padded = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge")
    h, w = image.shape[:2]
    around = [padded[y : y + h, x : x + w] for y in range(3) for x in range(3)]
    return np.max([np.abs(a - image).max(-1) for a in around], 0) > threshold


def error(a, b):
    return float(np.sqrt(np.mean((a - b) ** 2)))


def worst(a, b):
    """What one pixel of a thousand is off by, or more."""
    return float(np.quantile(np.abs(a - b).max(-1), 0.999))


def main(blinn):
    print("| scene | threshold | samples a pixel | error | of equal counts with that error | gain | worst thousandth, of 16 |\n|---|---|---|---|---|---|---|")
    for name, words in SCENES.items():
        truth = picture(blinn, words, 256, seed=9)
        equal = {n: picture(blinn, words, n) for n in COUNTS}
        errors = np.array([error(equal[n], truth) for n in COUNTS])
        more = picture(blinn, words, 16, seed=1)
        for threshold in THRESHOLDS:
            chosen = differs(equal[4], threshold)
            mixed = np.where(chosen[..., None], (4 * equal[4] + 16 * more) / 20, equal[4])
            mean, off = 4 + 16 * chosen.mean(), error(mixed, truth)
            same = np.exp(np.interp(-np.log(off), -np.log(errors), np.log(COUNTS)))
            print(
                f"| {name} | {threshold} | {mean:.1f} | {off:.4f} | {same:.1f} | {same / mean:.2f} "
                f"| {worst(mixed, truth):.3f}, {worst(equal[16], truth):.3f} |",
                flush=True,
            )


if __name__ == "__main__":
    main(sys.argv[1])
