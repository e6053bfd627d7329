"""``filter.h``: one name for whichever estimator an image has."""

from __future__ import annotations

__all__ = ["filter_header"]


def filter_header(name: str) -> str:
    """Text of ``filter.h`` for an estimator whose C has the prefix ``name``."""
    macro = name.upper()
    kinds = "\n".join(f"typedef {name}{kind}_t filter{kind}_t;" for kind in ("", "_in", "_out"))
    return (f"/**\n * @file filter.h\n * @brief The estimator of this image: {name}.\n *\n"
            " * Generated; do not edit.\n */\n\n#ifndef FILTER_H\n#define FILTER_H\n\n"
            f"#include \"{name}.h\"\n\n"
            f"#define FILTER_INPUTS {macro}_INPUTS\n#define FILTER_OUTPUTS {macro}_OUTPUTS\n"
            f"#define filter_init {name}_init\n#define filter_reset {name}_reset\n"
            f"#define filter_update {name}_update\n\n{kinds}\n\n#endif\n")
