"""The command line, also as ``python -m boresight``: Ctrl-C ends its imports, too, in one line."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from typing import NoReturn


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code of `boresight.cli.main`."""
    default = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    try:
        if default:  # an exception in the midst of an import may be taken for a failed one
            signal.signal(signal.SIGINT, _stop)
        from boresight.cli import main as run  # a second, most of it numpy's

        if default:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        return run(argv)
    except KeyboardInterrupt:  # between the imports and what `run` catches
        _stop()


def _stop(*_: object) -> NoReturn:
    """End with nothing to clean up."""
    os.write(2, b"interrupted\n")
    os._exit(130)


if __name__ == "__main__":
    sys.exit(main())
