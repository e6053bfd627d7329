"""The command line, also as ``python -m boresight``."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code of `boresight.cli.main`."""
    try:
        from boresight.cli import main as run  # a second, most of it numpy's

        return run(argv)
    except KeyboardInterrupt:  # in the imports
        os.write(2, b"interrupted\n")
        os._exit(130)  # there is nothing to clean up


if __name__ == "__main__":
    sys.exit(main())
