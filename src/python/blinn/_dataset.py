"""Datasets, as ``blinn turntable --views`` writes them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any, Callable, Iterable, Sequence, Union

from ._blinn import RenderError, SceneWarning, check_dataset_options
from ._progress import Progress, shown_progress
from ._scene import Scene

# Options whose value is a list of names.
JOINED = ["lights"]

# The command with messages that name keywords.
COMMAND = "import sys; from blinn._blinn import main; sys.exit(main(['blinn', *sys.argv[1:]], keywords=True))"

Scenes = Union[str, "os.PathLike[str]", Scene, Iterable[Union[str, "os.PathLike[str]", Scene]]]


def write_dataset(
    scenes: Scenes,
    folder: str | os.PathLike[str],
    *,
    views: int,
    formats: str | Sequence[str] = "nerf",
    layers: str | Sequence[str] = (),
    name: str | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    **options: Any,
) -> list[Path]:
    """Write views around one scene or each of several, with their cameras, and return the paths of the new files.

    - ``scenes``: paths of files, folders or archives, or scenes of `load` and ``from_…`` at time 0. Bytes of other files
      than .glb need a ``name`` with their ending.
    - ``folder``: the formats choose the folders below it; several scenes have folders of their own.
    - ``views``: number of views of each scene.
    - ``formats``: of "nerf", "colmap" or "colmap-bin", "bop", "coco" or "coco-polygons", one or several.
    - ``layers``: beside depth, normals and mask, which every dataset has; names as in `Scene.render`.
    - ``name``: pattern of the files in the folder, such as "{stem}/images/####.jpg" or "{shard:05}.tar".
    - ``resume``: keeps images that are up to date.
    - ``progress``: as in `Scene.render`.
    - ``options``: those of ``blinn turntable`` with underscores, such as ``size=(640, 480)``, ``samples=16``,
      ``on="random"``, ``category=["wheel=car/wheel*", "object"]``, ``ledger="done.jsonl"`` and ``timeout=60``. True stands
      for a flag without value, a tuple of numbers for a vector, a list for a flag that is repeated.

    The work is done by the command in a process of its own, so the files equal those of the command bit for bit. Defects
    of scenes are issued as `SceneWarning`.

    Raises TypeError for options that the command does not have, ValueError for values that it does not take, and
    `RenderError` if a scene fails; all others are written by then.
    """
    check_dataset_options(list(options))
    flags = [f"--views={views}", f"--dataset={_list(formats)}"]
    if layers:
        flags.append(f"--aov={_list(layers)}")
    if resume:
        flags.append("--resume")
    for key, value in options.items():
        flags += _flags(key, value)
    sources = _several(scenes)
    if options.get("random_per_scene") and len({_is_in_memory(scene) for scene in sources}) > 1:
        # Names are relative to the folder of all scenes, and that of scenes in memory is temporary.
        raise ValueError("random_per_scene: scenes are either all files or all in memory; write the others to files")
    with tempfile.TemporaryDirectory(prefix="blinn-") as written:
        files = _files(sources, Path(written))
        if not files:
            raise ValueError("there are no scenes")
        out = os.path.join(folder, name or "")
        command = ["turntable", *flags, f"--output={out}", "--progress=json", "--print-paths", "--", *files]
        with shown_progress(progress) as callback:
            return _run(command, callback)


def _several(scenes: Scenes) -> list[str | os.PathLike[str] | Scene]:
    """Return one or several scenes as a list."""
    if isinstance(scenes, (str, os.PathLike, Scene)):
        return [scenes]
    return list(scenes)


def _is_in_memory(scene: str | os.PathLike[str] | Scene) -> bool:
    """Return whether a scene has no file."""
    return isinstance(scene, Scene) and (scene._source is None or not isinstance(scene._source.source, str))


def _files(scenes: Sequence[str | os.PathLike[str] | Scene], folder: Path) -> list[str]:
    """Return the files of scenes. Scenes in memory that have the same name get their number, so that their datasets differ."""
    sources = [scene._source for scene in scenes if isinstance(scene, Scene) and scene._source is not None]
    names = [source.name for source in sources if not isinstance(source.source, str)]
    is_repeated = len(set(names)) < len(names)
    return [_file(scene, folder, i, is_repeated) for i, scene in enumerate(scenes)]


def _file(scene: str | os.PathLike[str] | Scene, folder: Path, index: int, is_numbered: bool) -> str:
    """Return the file of a scene; one that is in memory is written to a folder."""
    if not isinstance(scene, Scene):
        return os.fspath(scene)
    source = scene._source
    if source is None or source.options or scene.time != 0:
        raise ValueError("a scene must be at time 0 and loaded without options; pass these to write_dataset")
    if isinstance(source.source, str):
        return source.source
    name = Path(source.name if source.name is not None else "scene")
    number = f"-{index + 1:05}" if is_numbered else ""
    path = folder / f"{index:05}" / f"{name.stem}{number}{name.suffix or '.glb'}"
    path.parent.mkdir()
    path.write_bytes(source.source)
    return str(path)


def _flags(key: str, value: Any) -> list[str]:
    """Return the flags of an option."""
    flag = "--" + key.rstrip("_").replace("_", "-")
    if value is None or value is False:
        return []
    if value is True:
        return [flag]
    if isinstance(value, (str, os.PathLike)):
        return [f"{flag}={os.fspath(value)}"]
    if key == "size" and hasattr(value, "__iter__"):
        return [f"{flag}={'x'.join(str(int(side)) for side in value)}"]
    if key not in JOINED and isinstance(value, list) and value and not isinstance(value[0], (int, float)):
        return [part for item in value for part in _flags(key, item)]
    if hasattr(value, "__iter__"):
        return [f"{flag}={_list(value)}"]
    return [f"{flag}={value}"]


def _list(values: Any) -> str:
    """Join values by commas."""
    return values if isinstance(values, str) else ",".join(str(value) for value in values)


def _run(command: list[str], callback: Callable[[float], object] | None) -> list[Path]:
    """Run the command. Return the paths that it prints. ``callback`` gets the finished fraction."""
    failures: list[str] = []
    messages: list[str] = []
    with tempfile.TemporaryFile() as paths:
        process = subprocess.Popen(
            [sys.executable, "-c", COMMAND, *command], stdin=subprocess.DEVNULL, stdout=paths, stderr=subprocess.PIPE
        )
        assert process.stderr is not None
        try:
            for raw in process.stderr:
                line = os.fsdecode(raw).rstrip("\n")
                if not line.startswith("{"):
                    messages.append(line.removeprefix("blinn: "))
                    continue
                event = json.loads(line)
                if event["event"] == "progress" and callback is not None:
                    callback(event["percent"] / 100)
                elif event["event"] == "warning":
                    warnings.warn(f"{event['scene']}: {event['text']}", SceneWarning, stacklevel=3)
                elif event["event"] == "failed":
                    failures.append(event["text"])
            code = process.wait()
        except BaseException:
            process.terminate()
            process.wait()
            raise
        finally:
            process.stderr.close()
        paths.seek(0)
        written = [Path(os.fsdecode(path)) for path in paths.read().split(b"\n") if path]
    if code == 2:
        raise ValueError("; ".join(messages))
    if code != 0:
        raise RenderError("; ".join(failures or messages) or f"blinn ended with code {code}")
    return written
