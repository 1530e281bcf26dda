"""Numbers of files, which may be anything."""

from __future__ import annotations

import math
from typing import Any


def number(values: dict[str, Any], name: str, low: float = -math.inf, high: float = math.inf) -> float | None:
    """Returns a number in a range; None for anything else."""
    value = values.get(name)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        return None
    return value if low <= value <= high else None


def numbers(values: dict[str, Any], name: str, count: int) -> list[float] | None:
    """Returns a list of numbers; None for anything else."""
    found = values.get(name)
    if not isinstance(found, list) or len(found) != count:
        return None
    return found if all(number({"": each}, "") is not None for each in found) else None


def members(values: dict[str, Any], name: str) -> dict[str, Any]:
    """Returns an object; an empty one for anything else."""
    found = values.get(name)
    return found if isinstance(found, dict) else {}


def set_number(owner: Any, name: str, value: float | None) -> None:
    """Sets a property of Blender, if there is a value."""
    if value is not None:
        setattr(owner, name, value)
