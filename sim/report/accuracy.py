"""Error in degrees over logs: fixed point against float64, and both against a reference."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.declarations import QUATERNION
from boresight.model.errors import InputError
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program
from boresight.sim.attitude.accuracy import attitude_error, attitude_rmse
from boresight.sim.attitude.outputs import attitude_of, euler_deg_of
from boresight.sim.attitude.rotation import quaternion_to_euler
from boresight.sim.records.record import Record

__all__ = ["ANGLES", "BINS", "Replay", "accuracy_section"]

FloatArray = npt.NDArray[np.float64]

#: Angles in the order of `sim.attitude.outputs.euler_deg_of`.
ANGLES = ("heading", "pitch", "roll")
#: Points of a curve, at most.
BINS = 1000


@dataclass(frozen=True, eq=False)
class Replay:
    """What one log gave.

    Parameters
    ----------
    log : Record
        The log; the outputs may belong to its leading samples only.
    fixed : mapping of output name to (n,)
        Outputs of the fixed-point program in their units.
    reference : mapping of output name to (n,), optional
        The same of the float64 reference.
    truth : bool
        Whether the log's attitude is exact; otherwise it is called a comparison.
    """

    log: Record
    fixed: Mapping[str, FloatArray]
    reference: Mapping[str, FloatArray] | None = None
    truth: bool = False

    def __post_init__(self) -> None:
        columns = [*self.fixed.values(), *(self.reference or {}).values()]
        shapes = {np.shape(c) for c in columns}
        if len(shapes) != 1 or any(len(s) != 1 or not 0 < s[0] <= len(self.log) for s in shapes):
            raise InputError(
                f"outputs must all have one shape (n,), n 1 to {len(self.log)}, "
                f"not {sorted(shapes)}"
            )

    @classmethod
    def of_words(
        cls,
        program: Program,
        log: Record,
        words: IntArray,
        *,
        reference: Mapping[str, FloatArray] | None = None,
        truth: bool = False,
    ) -> Replay:
        """From output words (n, n_outputs)."""
        fixed = {
            name: program.format(n).real(words[:, k])
            for k, (name, n) in enumerate(zip(program.output_names, program.outputs, strict=True))
        }
        return cls(log, fixed, reference, truth)

    @property
    def t(self) -> FloatArray:
        """Times [s] (n,) of all samples; their numbers where the log has none."""
        columns = self.log.columns
        return columns["t"].values if "t" in columns else np.arange(float(len(self.log)))

    @property
    def q(self) -> FloatArray | None:
        """Reference attitude (n, 4) of the samples that ran, if the log has one."""
        columns = self.log.columns
        if not all(name in columns for name in QUATERNION):
            return None
        return np.stack([columns[name].values[: len(self)] for name in QUATERNION], axis=1)

    @property
    def mov(self) -> npt.NDArray[np.bool_] | None:
        """Which of the samples that ran count, if the log says so."""
        columns = self.log.columns
        return columns["mov"].values[: len(self)] != 0.0 if "mov" in columns else None

    def __len__(self) -> int:
        """Count the samples that ran."""
        return len(next(iter(self.fixed.values())))


def _number(x: float, digits: int = 6) -> float | None:
    return float(f"{x:.{digits}g}") if math.isfinite(x) else None


def _curve(x: FloatArray) -> list[float | None]:
    return [_number(float(v), 5) for v in x]


class _Bins:
    """Cuts n samples into at most `BINS` runs of equal length."""

    def __init__(self, n: int) -> None:
        self.size = -(-n // BINS)
        self.starts = np.arange(0, n, self.size)

    def first(self, x: FloatArray) -> FloatArray:
        """First finite value of each run, NaN if there is none."""
        out = np.full(len(self.starts), np.nan)
        for k, start in enumerate(self.starts):
            part = x[start : start + self.size]
            good = part[np.isfinite(part)]
            out[k] = good[0] if len(good) else np.nan
        return out

    def largest(self, x: FloatArray) -> FloatArray:
        """Largest value of each run, NaN if it has none."""
        lowest = np.where(np.isfinite(x), x, -np.inf)
        top = np.maximum.reduceat(lowest, self.starts)
        return np.where(np.isinf(top), np.nan, top)


def _wrapped_deg(d: FloatArray) -> FloatArray:
    return np.abs((d + 180.0) % 360.0 - 180.0)


def _vs_float(replay: Replay, bins: _Bins, series: dict[str, Any]) -> dict[str, Any]:
    """Fixed point against float64."""
    keys = (
        "vs_float_max_deg",
        "vs_float_max_sample",
        "vs_float_rms_deg",
        "vs_float_until_80_deg",
        "vs_float_attitude_max_deg",
    )
    found: dict[str, Any] = dict.fromkeys(keys)
    if replay.reference is None:
        return found
    if all(a in replay.fixed for a in ANGLES):
        ours, theirs = euler_deg_of(replay.fixed), euler_deg_of(replay.reference)
        apart = _wrapped_deg(ours - theirs)
        worst = apart.max(axis=1)
        steep = np.abs(theirs[:, ANGLES.index("pitch")]) > 80.0
        until = int(np.argmax(steep)) if steep.any() else len(worst)
        found |= {
            "vs_float_max_deg": _number(float(worst.max())),
            "vs_float_max_sample": int(worst.argmax()),
            "vs_float_rms_deg": _number(float(np.sqrt(np.mean(worst**2)))),
            "vs_float_until_80_deg": _number(float(worst[:until].max())) if until else None,
        }
        series["vs_float_deg"] = {
            a: _curve(bins.largest(apart[:, k])) for k, a in enumerate(ANGLES)
        }
    if "qw" in replay.fixed:
        total = attitude_error(attitude_of(replay.fixed), attitude_of(replay.reference)).total
        found["vs_float_attitude_max_deg"] = _number(float(total.max()))
    return found


def _vs_log(replay: Replay, bins: _Bins, series: dict[str, Any]) -> dict[str, Any]:
    """Fixed point and float64 against the log's own attitude."""
    found: dict[str, Any] = {"rmse_deg": None, "float_rmse_deg": None}
    n, q, mov = len(replay), replay.q, replay.mov
    if q is None or "qw" not in replay.fixed:
        return found
    counts = ~np.isnan(q).any(axis=1) & (True if mov is None else mov)
    if not counts.any():
        return found
    for key, outputs in (("rmse_deg", replay.fixed), ("float_rmse_deg", replay.reference)):
        if outputs is not None:
            rmse = attitude_rmse(attitude_of(outputs), q, mov)
            found[key] = {k: _number(v) for k, v in rmse._asdict().items()}
    known = ~np.isnan(q).any(axis=1)
    euler = np.full((n, 3), np.nan)
    euler[known] = np.degrees(quaternion_to_euler(q[known]))[:, _LOG_ORDER]
    error = attitude_error(attitude_of(replay.fixed), q)
    series["log_deg"] = {a: _curve(bins.first(euler[:, k])) for k, a in enumerate(ANGLES)}
    series["vs_log_deg"] = {
        "heading": _curve(bins.largest(error.heading)),
        "inclination": _curve(bins.largest(error.inclination)),
    }
    return found


#: Columns of `quaternion_to_euler` in the order of `ANGLES`.
_LOG_ORDER: list[int] = [2, 0, 1]


def _one(replay: Replay, program: Program) -> dict[str, Any]:
    n, t = len(replay), replay.t
    bins = _Bins(n)
    series: dict[str, Any] = {"samples_per_point": bins.size, "t_s": _curve(t[bins.starts] - t[0])}
    if all(a in replay.fixed for a in ANGLES):
        euler = euler_deg_of(replay.fixed)
        series["fixed_deg"] = {a: _curve(bins.first(euler[:, k])) for k, a in enumerate(ANGLES)}
    return {
        "dataset": replay.log.name,
        "samples": n,
        "seconds": _number(float(t[n - 1] - t[0])),
        "word": program.arithmetic.word,
        "reference": None if replay.q is None else "truth" if replay.truth else "comparison",
        **_vs_float(replay, bins, series),
        **_vs_log(replay, bins, series),
        "series": series,
    }


def accuracy_section(
    program: Program, replays: Sequence[Replay], warn: Callable[[str], None]
) -> dict[str, Any]:
    """Figures of the first log, and in ``logs`` those of every log with its curves.

    ``vs_float_max_deg`` is the largest difference of an Euler angle in any sample,
    ``vs_float_until_80_deg`` the same before the pitch first passes 80 deg,
    ``vs_float_attitude_max_deg`` the largest turn between the two attitudes. ``rmse_deg`` is taken
    against the log's attitude, which is the truth or a comparison (``reference``).
    """
    logs = [_one(replay, program) for replay in replays]
    if not logs:
        warn("accuracy: no log was run")
    attitudes = [one for one, r in zip(logs, replays, strict=True) if "qw" in r.fixed]
    for one in attitudes:
        if one["vs_float_max_deg"] is None and one["vs_float_attitude_max_deg"] is None:
            warn(f"accuracy: no float64 run of {one['dataset']} to compare with")
        if one["reference"] is None:
            warn(f"accuracy: {one['dataset']} has no attitude to compare with")
    keys = (
        "dataset",
        "samples",
        "seconds",
        "word",
        "reference",
        "vs_float_max_deg",
        "vs_float_max_sample",
        "vs_float_rms_deg",
        "vs_float_until_80_deg",
        "vs_float_attitude_max_deg",
        "rmse_deg",
        "float_rmse_deg",
    )
    first = logs[0] if logs else dict.fromkeys(keys)
    return {**{key: first[key] for key in keys}, "verdict": None, "logs": logs}
