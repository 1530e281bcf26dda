"""A bar that shows the progress of a render."""

from __future__ import annotations

import importlib
import sys
from contextlib import contextmanager
from typing import Any, Callable, Iterator, Union

Progress = Union[bool, Callable[[float], object]]

WIDTH = 40


def progress_callback(progress: Progress | None) -> Callable[[float], object] | None:
    """Return the callback for the argument ``progress``: a function as it is, a bar for True, None for False."""
    if progress is None or callable(progress):
        return progress
    return _Bar() if progress else None


@contextmanager
def shown_progress(progress: Progress | None) -> Iterator[Callable[[float], object] | None]:
    """Give the callback for the argument ``progress``, and end the line of its bar after errors and interrupts as well."""
    callback = progress_callback(progress)
    try:
        yield callback
    finally:
        if isinstance(callback, _Bar):
            callback.close()


class _Bar:
    """A bar on standard error, of tqdm if it is installed. It ends its line once: when it is full, or closed."""

    def __init__(self) -> None:
        self._tqdm: Any = None
        self._is_started = False
        self._is_closed = False

    def __call__(self, fraction: float) -> None:
        if self._is_closed:
            return
        if not self._is_started:
            self._is_started = True
            self._tqdm = _tqdm()
        if self._tqdm is not None:
            self._tqdm.update(100 * fraction - self._tqdm.n)
        else:
            done = round(WIDTH * fraction)
            sys.stderr.write(f"\r[{'#' * done}{' ' * (WIDTH - done)}] {100 * fraction:3.0f} %")
            sys.stderr.flush()
        if fraction >= 1:
            self.close()

    def __del__(self) -> None:
        self.close()

    def close(self) -> None:
        """End the line."""
        if self._is_closed:
            return
        self._is_closed = True
        if self._tqdm is not None:
            self._tqdm.close()
        elif self._is_started:
            sys.stderr.write("\n")
            sys.stderr.flush()


def _tqdm() -> Any:
    """Return a bar of tqdm, or None if it is not installed."""
    try:
        # Found by name, as tqdm has no types.
        tqdm = importlib.import_module("tqdm.auto")
    except ImportError:
        return None
    return tqdm.tqdm(total=100, unit="%", bar_format="{l_bar}{bar}| {elapsed}<{remaining}")
