"""Fixtures of the tests of the Python package. They run with the installed wheel and the clone's models."""

from pathlib import Path

import pytest

import blinn

MODELS = Path(__file__).resolve().parents[2] / "models"

QUAD = {
    "vertices": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]],
    "faces": [[0, 1, 2], [0, 2, 3]],
}


@pytest.fixture(scope="session")
def models() -> Path:
    return MODELS


@pytest.fixture(scope="session")
def lecture() -> blinn.Scene:
    return blinn.load(MODELS / "lecture/lecture.obj")


@pytest.fixture()
def quad() -> blinn.Scene:
    """A square from -1 to 1 in the plane z = 0, seen from +Z."""
    return blinn.Scene.from_arrays(**QUAD)
