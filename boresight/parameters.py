"""Parameter values from the command line and from files.

A file is one JSON object: either parameter values by name, or an object with those under
``parameters`` and the estimator's name under ``estimator``, as `boresight tune -o` writes it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError
from boresight.model.estimators import estimator as find_estimator

__all__ = ["parse_settings", "read_params", "values_for"]


def parse_settings(items: Sequence[str]) -> dict[str, float]:
    """Values of ``NAME=NUMBER`` texts, the last one of a name counting.

    Raises
    ------
    InputError
        A text of another form.
    """
    out = {}
    for item in items:
        name, _, text = item.partition("=")
        try:
            out[name] = float(text)
        except ValueError:
            raise InputError.at(
                f"--param {item}",
                wanted="NAME=NUMBER",
                found=repr(text),
                fix="write for example --param kp_pitch_per_s=0.5",
            ) from None
    return out


def read_params(path: str | Path) -> tuple[str | None, dict[str, float]]:
    """Estimator's name (None if the file has none) and values of a parameter file.

    Raises
    ------
    InputError
        The file cannot be read, is not JSON, or does not hold numbers by name.
    """
    path = Path(path)
    try:
        data: Any = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError.at(
            str(path),
            wanted="a parameter file that can be read",
            found=(error.strerror or type(error).__name__).lower(),
            fix="check the path",
        ) from None
    except ValueError as error:
        raise InputError.at(
            str(path),
            wanted="a JSON object with parameter values",
            found=f"no JSON ({error})",
            fix="correct the file",
        ) from None
    name, values = None, data
    if isinstance(data, dict) and "parameters" in data:
        name, values = data.get("estimator"), data["parameters"]
    if not isinstance(values, dict) or not (name is None or isinstance(name, str)):
        raise InputError.at(
            str(path),
            wanted="a JSON object with parameter values",
            found=type(values).__name__,
            fix='write for example {"kp_pitch_per_s": 0.5}',
        )
    for key, value in values.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError.at(
                f"{path}, {key}", wanted="a number", found=repr(value)[:40], fix="correct the file"
            )
    return name, {key: float(value) for key, value in values.items()}


def values_for(
    estimator: str, files: Sequence[str | Path] = (), settings: Sequence[str] = ()
) -> dict[str, float]:
    """Values for one estimator: files in order, then ``NAME=NUMBER`` texts on top.

    Raises
    ------
    InputError
        No such estimator, a file for another one, an unknown name, or an illegal value.
    """
    out: dict[str, float] = {}
    target = find_estimator(estimator)
    for path in files:
        name, values = read_params(path)
        if name is not None and name != estimator:
            raise InputError.at(
                str(path),
                wanted=f"parameters of {estimator}",
                found=f"those of {name}",
                fix="choose the file that fits",
            )
        out |= values
    out |= parse_settings(settings)
    target.param_values(out)
    return out
