"""Writes display colours of Blender's own OpenColorIO configuration as tables for the unit tests.

    pip install opencolorio numpy
    python docs/scripts/view_reference.py PATH/datafiles/colormanagement/config.ocio src/render/display/testdata

The configuration comes with Blender (tables measured with 5.0.1 and PyOpenColorIO 2.6.0). Colours are
scene-linear Rec.709; results are sRGB, encoded, as computed in float and not rounded to bytes.
"""

import sys
from itertools import product
from pathlib import Path

import numpy as np
import PyOpenColorIO as ocio


LOOKS = ["Very Low Contrast", "Low Contrast", "Medium Low Contrast", "Base Contrast", "Medium High Contrast",
         "High Contrast", "Very High Contrast", "Punchy", "Greyscale"]
FILMIC_LOOKS = ["Very Low Contrast", "Low Contrast", "Medium Low Contrast", "Medium Contrast", "Medium High Contrast",
                "High Contrast", "Very High Contrast"]


def shown(config, view, rgb, look=""):
    """Returns display values of scene-linear colours, without OpenColorIO's arithmetic optimizations."""
    linear = "Linear Rec.709"
    transform = ocio.GroupTransform()
    if look:
        transform.appendTransform(ocio.LookTransform(src=linear, dst=linear, looks=look))
    transform.appendTransform(ocio.DisplayViewTransform(src=linear, display="sRGB", view=view))
    cpu = config.getProcessor(transform).getOptimizedCPUProcessor(ocio.OPTIMIZATION_NONE)
    out = np.array(rgb, np.float32)
    cpu.applyRGB(out)
    # The last matrices leave traces of 1e-8 around 0 and 1.
    return np.clip(out.astype(np.float64), 0.0, 1.0)


def short(rows):
    """Rounds to four digits."""
    return [[float(f"{v:.4g}") for v in row] for row in rows]


def agx_colours():
    """Greys, primaries, saturated and random colours over 20 stops; black, out of gamut, beyond the range."""
    rng = np.random.default_rng(5)
    grey = [[0.18 * 2.0**e] * 3 for e in range(-12, 9, 2)]
    pure = [
        [light * c for c in colour]
        for colour in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 1, 1), (1, 0, 1), (1, 1, 0))
        for light in (0.05, 0.5, 4.0)
    ]
    any_hue = np.sort(rng.random((20, 3)) ** 3, axis=1)
    for row in any_hue:
        rng.shuffle(row)
    scattered = any_hue / any_hue.max(1, keepdims=True) * 0.18 * 2.0 ** rng.uniform(-8.0, 7.0, (20, 1))
    edges = [
        [0.0, 0.0, 0.0],
        [-1.0, -1.0, -1.0],
        [-1.0, 0.5, 0.5],
        [-0.1, 0.5, 2.0],
        [0.3, -0.05, 0.1],
        [0.2, 0.4, -0.08],
        [4000.0, 0.0, 0.0],
        [10000.0, 10000.0, 10000.0],
        [1e30, 1e30, 1e30],
    ]
    ramp = product([0.0, 0.0028, 0.045, 0.18, 1.0, 8.0], repeat=3)
    return short(grey + pure + scattered.tolist() + edges + [list(c) for c in ramp])


def filmic_colours():
    """Greys and colours below the light that fades to white; above it, nodes of Blender's table."""
    rng = np.random.default_rng(7)
    grey = [[0.18 * 2.0**e] * 3 for e in np.arange(-12.0, 9.0, 0.5)]
    edges = [[0.0, 0.0, 0.0], [-1.0, -1.0, -1.0], [0.3, -0.05, 0.1], [1e30, 1e30, 1e30]]
    below = 8.0 * 2.0 ** rng.uniform(-12.0, 0.0, (150, 3))
    node = lambda k: float(np.float32(2.0 ** (25.0 * k / 32.0 - 12.473931188)))
    bright = [[node(k) for k in row] for row in rng.integers(1, 33, (60, 3)) if max(row) > 20]
    return short(grey + edges + below.tolist()) + bright


def filmic_look_colours():
    """Greys, colours below the light that fades to white, and any above it; black, out of gamut, beyond the range."""
    rng = np.random.default_rng(11)
    grey = [[0.18 * 2.0**e] * 3 for e in range(-10, 8)]
    below = (8.0 * 2.0 ** rng.uniform(-10.0, 0.0, (20, 3))).tolist()
    bright = rng.random((17, 3)) ** 3 * 2.0 ** rng.uniform(4.0, 8.0, (17, 1))
    edges = [[0.0, 0.0, 0.0], [-1.0, -1.0, -1.0], [0.3, -0.05, 0.1], [14.0, 0.0, 0.01], [1e30, 1e30, 1e30]]
    return short(grey + below + bright.tolist() + edges)


def neutral_colours():
    """Nodes of Blender's table, where it equals Khronos's formula."""
    nodes = [(26, 26, 26), (20, 22, 19), (27, 10, 5), (29, 26, 15), (30, 30, 30),
             (33, 20, 20), (40, 30, 20), (5, 45, 38), (15, 25, 50), (56, 56, 56)]
    return [[float(np.float32(2.0 ** (-9.0 + 19.0 * k / 56.0))) for k in row] for row in nodes]


def main():
    config = ocio.Config.CreateFromFile(sys.argv[1])
    folder = Path(sys.argv[2])
    tables = {"agx": ("AgX", agx_colours()), "filmic": ("Filmic", filmic_colours()),
              "neutral": ("Khronos PBR Neutral", neutral_colours())}
    for name, (view, rows) in tables.items():
        encoded = [[round(float(v), 6) for v in row] for row in shown(config, view, rows)]
        lines = [f"{numbers(i)},{numbers(o)}\n" for i, o in zip(rows, encoded)]
        (folder / f"{name}.csv").write_text("".join(lines))
    lines = []
    rows = agx_colours()[:70:2]
    for look in LOOKS:
        encoded = [[round(float(v), 6) for v in row] for row in shown(config, "AgX", rows, f"AgX - {look}")]
        lines += [f"{look},{numbers(i)},{numbers(o)}\n" for i, o in zip(rows, encoded)]
    (folder / "looks.csv").write_text("".join(lines))
    lines = []
    rows = filmic_look_colours()
    for view in ("Filmic", "Standard"):
        for look in FILMIC_LOOKS:
            encoded = [[round(float(v), 6) for v in row] for row in shown(config, view, rows, look)]
            lines += [f"{view},{look},{numbers(i)},{numbers(o)}\n" for i, o in zip(rows, encoded)]
    (folder / "filmic_looks.csv").write_text("".join(lines))


def numbers(values):
    """Returns the shortest f32 representation of each value."""
    digits = (np.format_float_positional(np.float32(v), trim="0") if v < 1e6 else f"{v:.0e}".replace("+", "") for v in values)
    return ",".join(digits)


if __name__ == "__main__":
    main()
