"""Pictures for a viewport, rendered in a thread: a small one at once, then better ones until the view changes."""

from __future__ import annotations

import tempfile
import threading
import time
from pathlib import Path
from typing import Any, Callable, NamedTuple

import numpy

from . import engine_export

# Seconds for the first picture of a view, and its largest and smallest share of the viewport's sides.
FIRST = 0.15
LARGEST, SMALLEST = 1 / 2, 1 / 8


class View(NamedTuple):
    """What a viewport shows."""

    camera: Callable[[tuple[int, int]], Any]
    key: tuple[Any, ...]
    size: tuple[int, int]


class Export(NamedTuple):
    """A copy of the scene that is to be exported."""

    folder: tempfile.TemporaryDirectory
    choice: list[str]
    load: dict[str, Any]
    render: dict[str, Any]


class Obsolete(Exception):
    """A picture of an old view."""


class Renderer:
    """A thread that exports the scene and renders views of it."""

    def __init__(self, blinn: Any) -> None:
        self.blinn = blinn
        self.changed = threading.Condition()
        self.view: View | None = None
        self.export: Export | None = None
        self.is_closed = False
        self.share = LARGEST
        # The last picture, linear with the lowest row first, and the number of pictures so far.
        self.picture: numpy.ndarray | None = None
        self.count = 0
        self.status = "Exporting"
        self.thread = threading.Thread(target=self.work, name="blinn viewport", daemon=True)
        self.thread.start()

    def show(self, view: View) -> None:
        """Asks for pictures of a view."""
        with self.changed:
            if self.view is None or self.view.key != view.key:
                self.view = view
                self.changed.notify()

    def replace_scene(self, export: Export) -> None:
        """Asks for pictures of another state of the scene. The old ones stay until it is loaded."""
        with self.changed:
            old, self.export = self.export, export
            self.changed.notify()
        if old is not None:
            old.folder.cleanup()

    def close(self) -> None:
        """Ends the thread as soon as it can."""
        with self.changed:
            self.is_closed = True
            self.changed.notify()

    def work(self) -> None:
        scene, options, done = None, {}, None
        while True:
            with self.changed:
                while not self.is_closed and self.export is None and (scene is None or self.view in (None, done)):
                    self.changed.wait()
                export, self.export, view = self.export, None, self.view
            if self.is_closed:
                if export is not None:
                    export.folder.cleanup()
                return
            try:
                if export is not None:
                    loaded = self.load(export)
                    if loaded is not None:
                        scene, options, done = loaded, export.render, None
                elif view is not None:
                    self.refine(scene, view, options)
                    done = view
            except Obsolete:
                pass
            except Exception as error:
                # Until the scene or the view changes.
                self.status, done = f"blinn: {error}", view

    def load(self, export: Export) -> Any:
        """Returns the exported scene; None if another one is waited for."""
        self.status = "Exporting"
        with export.folder as folder:
            exported = engine_export.convert(export.choice, Path(folder), lambda: self.is_closed or self.export is not None)
            if exported is None:
                return None
            self.status = "Loading"
            return self.blinn.load(exported.glb, **export.load)

    def refine(self, scene: Any, view: View, options: dict[str, Any]) -> None:
        """Renders a view at growing size and quality."""
        samples, first = options.get("samples", 1), True
        for share, count in [(self.share, 1), (1.0, 1), (1.0, min(4, samples)), (1.0, samples)]:
            size = tuple(max(1, round(side * share)) for side in view.size)
            start = time.perf_counter()
            picture = scene.render(
                view.camera(size), size=size, progress=lambda _: self.follow(view), **{**options, "samples": count}
            )
            seconds = time.perf_counter() - start
            if first:
                self.adapt(seconds)
                first = False
            self.follow(view)
            with self.changed:
                self.picture = numpy.ascontiguousarray(picture.linear[::-1], numpy.float32)
                self.count += 1
                self.status = f"{count} of {samples} samples" if count < samples else ""

    def adapt(self, seconds: float) -> None:
        """Chooses the size of first pictures by the time that one took."""
        if seconds > FIRST:
            self.share = max(SMALLEST, self.share / 2.0)
        elif seconds < FIRST / 5.0:
            self.share = min(LARGEST, self.share * 2.0)

    def follow(self, view: View) -> None:
        if self.is_closed or self.export is not None or self.view is not view:
            raise Obsolete
