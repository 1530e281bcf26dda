"""A bar that shows the progress of a render."""

from __future__ import annotations

import importlib
import sys
from typing import Callable, Union

Progress = Union[bool, Callable[[float], object]]

WIDTH = 40


def progress_callback(progress: bool | Callable[[float], object] | None) -> Callable[[float], object] | None:
    """Return the callback for the argument ``progress``: a function as it is, a bar for True, None for False."""
    if progress is None or callable(progress):
        return progress
    return _bar() if progress else None


def _bar() -> Callable[[float], object]:
    """Return a callback that shows a bar on standard error: tqdm's if it is installed."""
    try:
        # Found by name, as tqdm has no types.
        tqdm = importlib.import_module("tqdm.auto")
    except ImportError:
        return _text_bar()
    bar = tqdm.tqdm(total=100, unit="%", bar_format="{l_bar}{bar}| {elapsed}<{remaining}")

    def update(fraction: float) -> None:
        bar.update(100 * fraction - bar.n)
        if fraction >= 1:
            bar.close()

    return update


def _text_bar() -> Callable[[float], object]:
    """Return a callback that draws a bar of characters."""

    def update(fraction: float) -> None:
        done = round(WIDTH * fraction)
        end = "\n" if fraction >= 1 else ""
        sys.stderr.write(f"\r[{'#' * done}{' ' * (WIDTH - done)}] {100 * fraction:3.0f} %{end}")
        sys.stderr.flush()

    return update
