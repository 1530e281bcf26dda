"""Renders views of a model from all sides, with depth: python views.py MODEL FOLDER [COUNT]"""

import math
import sys
from pathlib import Path

import numpy as np

import blinn


def cameras_around(scene: blinn.Scene, count: int) -> list[blinn.Camera]:
    """Return cameras on a circle that see the whole scene."""
    low, high = scene.bounds
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    angles = [2 * math.pi * i / count for i in range(count)]
    eyes = [centre + 3 * radius * np.array([math.sin(a), 0.4, math.cos(a)]) for a in angles]
    return [blinn.Camera.look_at(eye, centre, yfov=40) for eye in eyes]


def main(model: str, folder: Path, count: int = 8) -> None:
    """Write COUNT pictures, and their depth as float32 arrays."""
    folder.mkdir(parents=True, exist_ok=True)
    scene = blinn.load(model)
    pictures = scene.render_many(cameras_around(scene, count), size=(256, 256), layers="depth", exposure=0)
    for i, picture in enumerate(pictures):
        picture.save(folder / f"{i:04}.png")
        np.save(folder / f"{i:04}.npy", picture["depth"])


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), *map(int, sys.argv[3:]))
