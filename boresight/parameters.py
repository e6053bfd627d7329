"""Parameter values from the command line and from files.

A file is one JSON object: either parameter values by name, or an object with those under
``parameters`` and the estimator's name under ``estimator``, as `boresight tune -o` writes it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError
from boresight.model.resolve import Named
from boresight.model.resolve import estimator_of as find_estimator
from boresight.sim.records.reading import kind_of, read_json

__all__ = ["parse_settings", "read_params", "values_for"]


#: A setting of each option that takes some.
_EXAMPLES = {
    "--param": "kp_pitch_per_s=0.5",
    "--allow": "cycles=0.01",
    "--weight": "vel=0.5",
    "--feed": "east=0.6",
}


def parse_settings(items: Sequence[str], option: str = "--param") -> dict[str, float]:
    """Values of ``NAME=NUMBER`` texts; the last text of a name counts.

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
                option,
                wanted="NAME=NUMBER",
                found=repr(item),
                fix=f"write for example {option} {_EXAMPLES.get(option, 'NAME=0.5')}",
            ) from None
    return out


def read_params(path: str | Path) -> tuple[str | None, dict[str, float]]:
    """Estimator's name (None if the file has none) and values of a parameter file.

    Raises
    ------
    InputError
        The file cannot be read, is not JSON, or does not hold numbers by name.
    """
    data = read_json(path, "a parameter file")
    name, values = None, data
    if isinstance(data, dict) and "parameters" in data:
        name, values = data.get("estimator"), data["parameters"]
    if not isinstance(values, dict) or not (name is None or isinstance(name, str)):
        raise InputError.at(
            str(path),
            wanted="a JSON object with parameter values",
            found=kind_of(values),
            fix='write for example {"kp_pitch_per_s": 0.5}',
        )
    return name, {key: _number(f"{path}, {key}", value) for key, value in values.items()}


def _number(where: str, value: Any) -> float:
    """Return a value of a file as float; raise InputError if it is not a finite number."""
    try:
        if not isinstance(value, bool) and isinstance(value, int | float):
            return float(value)
    except OverflowError:
        pass
    raise InputError.at(where, wanted="a number", found=kind_of(value), fix="correct the file")


def values_for(
    estimator: Named, files: Sequence[str | Path] = (), settings: Sequence[str] = ()
) -> dict[str, float]:
    """Values for one estimator: files in order, then ``NAME=NUMBER`` texts on top.

    Raises
    ------
    InputError
        Unknown estimator, a file for another estimator, an unknown name, or an illegal value.
    """
    out: dict[str, float] = {}
    target = find_estimator(estimator)
    for path in files:
        name, values = read_params(path)
        if name is not None and name != target.name:
            raise InputError.at(
                str(path),
                wanted=f"parameters of {target.name}",
                found=f"those of {name}",
                fix="choose the file that fits",
            )
        try:
            target.param_values(values)
        except InputError as error:
            parts = {**error.parts, "where": f"{path}, {error.parts['where']}"}
            raise InputError.at(**parts) from None
        out |= values
    out |= parse_settings(settings)
    target.param_values(out)
    return out
