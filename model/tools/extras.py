"""Optional libraries: imported where they are used, or one line says how to install them."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from boresight.model.errors import ToolMissing

#: Extra of `pyproject.toml` by library.
_EXTRAS = {
    "amaranth_boards": "board",
    "distributed": "cluster",
    "matplotlib": "plots",
    "pyarrow": "logs",
    "pymap3d": "systems",
    "pyulog": "ulog",
    "rosbags": "ros",
    "scipy": "logs",
    "serial": "board",
    "vqf": "published",
}


def optional(name: str) -> ModuleType:
    """Import a module of an optional library; ToolMissing if that is not installed."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        library = name.partition(".")[0]
        if error.name is None or error.name.partition(".")[0] != library:
            raise
        extra = _EXTRAS[library]
        raise ToolMissing(f"{library} was not found: pip install 'boresight[{extra}]'") from None
