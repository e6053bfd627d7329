"""``filter.h``: fixed names for the estimator of an image."""

from __future__ import annotations

_HEAD = """\
/**
 * @file filter.h
 * @brief The estimator of this image: {what}.
 *
 * Generated; do not edit.
 */

#ifndef FILTER_H
#define FILTER_H

"""


def filter_header(name: str | None, *, single: bool = False, number: int = 0) -> str:
    """Text of ``filter.h``.

    Parameters
    ----------
    name : str or None
        Prefix of the estimator's C; None for an image without estimator.
    single : bool
        Whether the estimator is float C.
    number : int
        Number of the estimator in the system.
    """
    if name is None:
        return _HEAD.format(what="none") + "#define FILTER_KIND 0\n\n#endif\n"
    macro = name.upper()
    kinds = "\n".join(f"typedef {name}{kind}_t filter{kind}_t;" for kind in ("", "_in", "_out"))
    return _HEAD.format(what=name) + (
        f'#include "{name}.h"\n\n'
        f"#define FILTER_KIND {2 if single else 1} // 1: integer words, 2: float\n"
        f"#define FILTER_NUMBER {number}u // in the system\n"
        f"#define FILTER_INPUTS {macro}_INPUTS\n#define FILTER_OUTPUTS {macro}_OUTPUTS\n"
        f"#define filter_init {name}_init\n#define filter_reset {name}_reset\n"
        f"#define filter_update {name}_update\n\n{kinds}\n\n#endif\n"
    )
