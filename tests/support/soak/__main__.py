"""``python -m tests.support.soak``: see `tests.support.soak.search`."""

import sys

from tests.support.soak.search import main

if __name__ == "__main__":
    sys.exit(main())
