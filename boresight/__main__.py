"""The command line, also as ``python -m boresight``: Ctrl-C ends its imports, too, in one line."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code of `boresight.cli.main`."""
    try:
        from boresight.cli import main as run  # a second, most of it numpy's
    except KeyboardInterrupt:
        os.write(2, b"interrupted\n")
        return 130
    return run(argv)


if __name__ == "__main__":
    sys.exit(main())
