"""``boresight fit board``: records to a file of registers, and what people are shown."""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from boresight.model.attitude.front import AXES, FRONT
from boresight.model.declarations import GRAVITY
from boresight.model.errors import require, require_choice
from boresight.model.tools.files import OutputFile
from boresight.sim.attitude.calibration.solve import Solution, observe, solve
from boresight.sim.records.files import log_files, logs_of
from boresight.sim.result import Result, plain

#: Of the Earth's field at the ground [uT] and of its gravity [m/s^2], with a margin; of sights.
_FIELD_UT, _GRAVITY, _SIGHT_DEG = (20.0, 70.0), (9.7, 9.9), (1e-4, 10.0)
#: rms of residuals in stated standard deviations, from which on they are told.
_LARGE = 3.0
#: The same, from which on nothing is written; and of sights and turns, which nothing disturbs.
_WRONG, _WRONG_TURN = 30.0, 10.0


def calibrated(
    *records: Any, field_ut: Sequence[float] = (), gravity: float = GRAVITY, sight_deg: float = 0.1
) -> Solution:
    """Fit the registers to records; see `solve.solve`."""
    least, most = _FIELD_UT
    wanted = f"the local field east, north, up in uT, {least:g} to {most:g} in all"
    parts = np.asarray(field_ut, dtype=object)
    good = parts.shape == (3,) and all(isinstance(x, int | float) for x in parts)
    good = good and least <= float(np.linalg.norm(field_ut)) <= most
    fix = 'for example "board(field_ut=(0, 27.9, -46.2))"; a model such as WMM gives it'
    require(good, "board, field_ut", wanted, field_ut, fix)
    for name, value, (low, high) in (
        ("gravity", gravity, _GRAVITY),
        ("sight_deg", sight_deg, _SIGHT_DEG),
    ):
        good = isinstance(value, int | float) and low <= value <= high
        require(good, f"board, {name}", f"{low:g} to {high:g}", value)
    return solve(observe(records), field_ut=field_ut, gravity=gravity, sight_deg=sight_deg)


def calibrate(sources: Sequence[Any], settings: Mapping[str, Any], output: str | Path) -> Result:
    """Fit the registers to logs, and write them as a file of parameters, with uncertainties.

    Nothing is written if residuals are far beyond their stated standard deviations.
    """
    known = inspect.signature(calibrated).parameters
    for name in settings:
        require_choice("board", name, [n for n in known if n != "records"])
    wanted = "records of rests, positions, a swing and sights"
    require(len(sources) > 0, "logs", wanted, None, "name them")
    files = log_files(s for s in sources if isinstance(s, str | Path))
    target = OutputFile(output, inputs=files)
    logs = logs_of(sources, load=True)
    solution = calibrated(*(log.data for log in logs), **settings)
    data = {
        "parameters": solution.registers,
        "sigma": solution.sigma,
        "mounting": {"T": solution.sensor_mounting, "T0": solution.mounting},
        "noise": dict(zip(("gyro", "acc", "field"), solution.variance, strict=True)),
        "residuals": [*solution.misfits],
        "settings": {**settings},
        "records": [log.name for log in logs],
    }
    wrong = [
        f"not written: {m.kind}: residuals of {m.rms:.0f} standard deviations; check units, signs "
        "and the order of axes of sights and field_ut"
        for m in solution.misfits
        if m.rms >= (_WRONG_TURN if m.kind in ("sights", "turns") else _WRONG)
    ]
    if not wrong:
        target.write(json.dumps(plain(data), indent=1) + "\n")
    notes = [
        f"{m.kind}: residuals of {m.rms:.1f} standard deviations; the uncertainties contain them"
        for m in solution.misfits
        if m.rms >= _LARGE and not wrong
    ]
    count = sum(map(len, solution.registers.values()))
    if "tick_s" not in solution.registers["calibrate_inertial"]:
        notes.append("no register tick_s: it needs the computer's time, of a log from a port")
    tables = {"registers": [*_rows(solution)], "noise at rest": [*_noise(solution)]}
    tables["residuals, in standard deviations"] = [
        {"kind": m.kind, "number": m.count, "rms": m.rms} for m in solution.misfits
    ]
    summary = f"{count} registers" + ("" if wrong else f" to {output}")
    return Result(data, tables, summary, notes, wrong[:1])


def _rows(solution: Solution) -> Iterator[dict[str, Any]]:
    """Registers by three, with their largest uncertainty."""
    for program, values in solution.registers.items():
        sigma = solution.sigma[program]
        units = {p.name: p.unit for p in FRONT[program].params}
        for stem in dict.fromkeys(n[:-1] for n in values if n != "tick_s"):
            names = [stem + a for a in AXES]
            yield {
                "register": f"{stem}*",
                **{a: values[n] for a, n in zip(AXES, names, strict=True)},
                "uncertainty": max(sigma[n] for n in names),
                "unit": units[names[0]],
            }
        if "tick_s" in values:
            yield {"register": "tick_s", "x": values["tick_s"], "uncertainty": sigma["tick_s"]}


def _noise(solution: Solution) -> Iterator[dict[str, Any]]:
    """Table 2 of Ma Long et al. (2014): the gyro's bias, variances of one sample."""
    inertial = solution.registers["calibrate_inertial"]
    bias = [inertial[f"gyro_bias_{a}"] for a in AXES]
    for name, values, unit in (
        ("gyro, bias", bias, "rad/s"),
        ("gyro, variance", solution.variance[0], "(rad/s)^2"),
        ("accelerometer, variance", solution.variance[1], "(m/s^2)^2"),
        ("magnetometer, variance", solution.variance[2], "uT^2"),
    ):
        yield {"noise": name, **dict(zip(AXES, map(float, values), strict=True)), "unit": unit}
