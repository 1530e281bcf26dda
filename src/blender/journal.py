"""Changes to the open file that are undone later."""

from __future__ import annotations

from typing import Any, Callable

import bpy

# Data that is gone, or that belongs to another file.
UNDONE_BY_BLENDER = (ReferenceError, RuntimeError, AttributeError)


class Journal:
    """A list of changes, undone in reverse order."""

    # Those that are not undone yet, if an export failed.
    unfinished: list[Journal] = []

    def __init__(self) -> None:
        self.undo: list[Callable[[], Any]] = []
        Journal.unfinished.append(self)

    def set(self, owner: Any, name: str, value: Any) -> None:
        """Sets an attribute that gets its old value back."""
        old = getattr(owner, name)
        setattr(owner, name, value)
        self.undo.append(lambda: setattr(owner, name, old))

    def add(self, collection: Any, block: Any) -> Any:
        """Returns a new block of data, to be removed from its collection."""
        self.undo.append(lambda: collection.remove(block))
        return block

    def restore(self) -> None:
        """Undoes all changes."""
        while self.undo:
            undo = self.undo.pop()
            try:
                undo()
            except UNDONE_BY_BLENDER:
                pass
        if self in Journal.unfinished:
            Journal.unfinished.remove(self)


@bpy.app.handlers.persistent
def restore_all(*_: Any) -> None:
    """Undoes what failed exports have left, before a file is saved and when Blender is idle."""
    for journal in reversed(Journal.unfinished[:]):
        journal.restore()


def register() -> None:
    bpy.app.handlers.save_pre.append(restore_all)


def unregister() -> None:
    restore_all()
    if restore_all in bpy.app.handlers.save_pre:
        bpy.app.handlers.save_pre.remove(restore_all)
