"""The command ``blinn``, also as ``python -m blinn``."""

import sys

from ._blinn import main as _main


def main() -> int:
    """Run the command with the arguments of this process and return its exit code."""
    return _main(["blinn", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
