"""Converts a .blend file to a GLB, in a process of its own that may change what it opened:

    blender --background --factory-startup --disable-autoexec --python convert.py -- ARGUMENTS
    python convert.py ARGUMENTS                                       (a Python with bpy)

Lines of the report are "KEY TEXT": `file` for each file that is linked, `warning`, and `error`.
"""

from __future__ import annotations

import argparse
import os
import sys
import traceback
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
PACKAGE = "blinn_extension"


def arguments() -> argparse.Namespace:
    """Returns the arguments, which follow `--` in Blender."""
    parser = argparse.ArgumentParser(prog="convert.py")
    parser.add_argument("--input", required=True, help="the .blend file")
    parser.add_argument("--output", required=True, help="the GLB")
    parser.add_argument("--report", required=True)
    parser.add_argument("--scene", help="name or index; default: the file's active scene")
    parser.add_argument("--view-layer", help="name of the view layer")
    parser.add_argument("--frame", type=float, help="one frame, without animation")
    parser.add_argument("--bake", choices=["never", "auto"], help="default: the scene's own setting")
    parser.add_argument("--bake-size", type=int, help="texels on a side of baked images")
    parser.add_argument("--only-folder", action="store_true", help="leave out images outside the file's folder")
    parser.add_argument("--memory", type=int, help="bytes that may be allocated")
    parser.add_argument("--end-with-input", metavar="FOLDER", help="end with standard input; FOLDER is then removed")
    given = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    return parser.parse_args(given)


def load_package() -> None:
    """Imports the extension under a name of its own, wherever it is installed."""
    import importlib.util

    spec = importlib.util.spec_from_file_location(
        PACKAGE, FOLDER / "__init__.py", submodule_search_locations=[str(FOLDER)]
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules[PACKAGE] = module
    spec.loader.exec_module(module)


def main() -> int:
    options = arguments()
    # Modules of this folder have names that Blender's own modules have, too.
    sys.path[:] = [path for path in sys.path if Path(path or ".").resolve() != FOLDER]
    sys.dont_write_bytecode = True
    with open(options.report, "wb") as report:

        def write(key: str, text: str) -> None:
            report.write(os.fsencode(f"{key} {' '.join(text.splitlines())}\n"))

        try:
            load_package()
            from blinn_extension import conversion

            conversion.convert(options, write)
        except Exception as error:
            write("error", reason(error))
            return 1
    return 0


def reason(error: Exception) -> str:
    """Returns the text of an error. Unexpected ones are printed as well, with their trace."""
    if type(error).__name__ == "ConversionError":
        return str(error)
    if isinstance(error, MemoryError):
        return "its conversion needs more memory than is allowed; allow more with `max-memory`"
    traceback.print_exception(error)
    if isinstance(error, ModuleNotFoundError):
        # Some distributions build Blender with the system's Python, and only recommend NumPy.
        return f"Blender's Python has no module {error.name}; install it, as python3-{error.name} on Debian"
    return f"{type(error).__name__}: {error}"


if __name__ == "__main__":
    # Without the shutdown of the interpreter, which frees a scene piece by piece.
    status = main()
    sys.stdout.flush()
    os._exit(status)
