"""One output beside its reference: how far apart, where, and whether that is accepted.

Values are compared in the output's unit; angles modulo their period; outputs named ``qw qx qy qz``
with the sign that brings the quaternions together, and besides as the angle between the attitudes,
in degrees: 180 where one of them has a norm beyond 0.5 to 2.

Words of `EXACT_UNITS` are decisions, compared bit by bit: a value within rounding of a threshold is
decided either way, and few words of many may differ. From there on both forms are right and need
not be near: values are judged where the decisions so far agree, and on the other rows by their root
mean square.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.declarations import EXACT_UNITS, PERIODS, QUATERNION, Output
from boresight.sim.attitude.rotation import quaternion_conjugate, quaternion_multiply

__all__ = ["ATTITUDE", "Decided", "Difference", "around", "differences"]

FloatArray = npt.NDArray[np.float64]

#: Name of the difference between attitudes.
ATTITUDE = "attitude"
#: Natural logarithm of a quaternion's norm that is no attitude's.
_NORMS = math.log(2.0)


@dataclass(frozen=True)
class Difference:
    """How far an output lies from its reference.

    Attributes
    ----------
    output, unit : str
        ``ATTITUDE`` in deg is the angle between two quaternions; of decisions the unit is "words".
    samples : int
        Compared; samples without a reference are left out, and those in ``after``.
    largest, rms : float
        NaN where a value is none.
    at_step : int or None
        Sample of the largest.
    tolerance : float or None
        None: shown, not judged.
    apart : float64 (n,)
        Of every sample; NaN where there is no reference, or no number.
    decided : Decided, optional
        Of decisions, how many differ.
    after : Difference, optional
        The samples from the first decision that differs on, judged by their root mean square.
    """

    output: str
    unit: str
    samples: int
    largest: float
    rms: float
    at_step: int | None
    tolerance: float | None
    apart: FloatArray = field(default_factory=lambda: np.zeros(0), repr=False, compare=False)
    decided: Decided | None = None
    after: Difference | None = None

    @classmethod
    def joined(cls, parts: Sequence[Difference], rows: Sequence[int]) -> Difference:
        """Differences of parts of so many rows that follow each other, not judged, as one."""
        seen = [p for p in parts if p.samples]
        if len(parts) == 1 or not seen:
            return parts[0]
        count = sum(p.samples for p in seen)
        largest = seen[int(np.argmax([p.largest for p in seen]))]  # the first that is no number
        start = next(sum(rows[:k]) for k, p in enumerate(parts) if p is largest)
        return replace(
            largest,
            samples=count,
            rms=math.sqrt(math.fsum(p.samples * p.rms**2 for p in seen) / count),
            at_step=None if largest.at_step is None else largest.at_step + start,
        )

    @property
    def first_beyond(self) -> int | None:
        """First sample beyond the tolerance; None if there is none."""
        if self.tolerance is None or self.good:
            return None
        return int(np.argmax(~(self.apart <= self.tolerance)))

    @property
    def good(self) -> bool:
        """Not judged, or within the tolerance over at least one sample; NaN is beyond any."""
        if self.tolerance is None or not self.samples:
            return self.tolerance is None
        if self.decided is not None:
            return math.isfinite(self.largest) and self.decided.good
        steady = self.after is None or self.after.rms <= self.tolerance
        return self.largest <= self.tolerance and steady

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "output": self.output,
            "unit": self.unit,
            "samples": self.samples,
            "max": self.largest if math.isfinite(self.largest) else None,
            "rms": self.rms if math.isfinite(self.rms) else None,
            "at_step": self.at_step,
            "tolerance": self.tolerance,
            "good": self.good,
            **({} if self.decided is None else {"decisions": asdict(self.decided)}),
            **({} if self.after is None else {"after": self.after.to_json()}),
        }

    def line(self) -> str:
        """One line for people."""
        unit = f" {self.unit}" if self.unit else ""
        if self.decided is not None and self.decided.differing and math.isfinite(self.largest):
            verdict = "within what is accepted" if self.good else "BEYOND what is accepted"
            return f"{self.output:12s} {self.decided} from step {self.at_step} on: {verdict}"
        if self.tolerance is None:
            verdict = "not judged"
        else:
            verdict = f"{'within' if self.good else 'BEYOND'} {self.tolerance:.3g}"
            if self.output == ATTITUDE and self.largest == 180.0:
                verdict += ", as one has a norm beyond 0.5 to 2, or is half a turn off"
        where = "" if self.at_step is None else f" in step {self.at_step}"
        text = f"max {self.largest:.3g}{unit}{where}, rms {self.rms:.3g}"
        if self.after is not None:
            text += f"; in {self.after.samples} updates after a decision that differs, max "
            text += f"{self.after.largest:.3g} in step {self.after.at_step}, rms "
            text += f"{self.after.rms:.3g}"
        return f"{self.output:12s} {text}: {verdict}"


@dataclass(frozen=True)
class Decided:
    """Decisions that differ.

    Attributes
    ----------
    differing, of : int
        Updates.
    longest : int
        Most of them in a row.
    most_share, most_longest : float, int
        What is accepted (`Output`).
    """

    differing: int
    of: int
    longest: int
    most_share: float
    most_longest: int

    @property
    def share(self) -> float:
        """Of the updates."""
        return self.differing / self.of

    @property
    def good(self) -> bool:
        """Few enough differ, and not too many in a row."""
        return self.share <= self.most_share and self.longest <= self.most_longest

    def __str__(self) -> str:
        return (
            f"{self.differing} of {self.of} decisions differ, a share of {self.share:.2g} "
            f"(accepted {self.most_share:.2g}), up to {self.longest} in a row (accepted "
            f"{self.most_longest})"
        )


def differences(
    outputs: Sequence[Output],
    values: Mapping[str, FloatArray],
    reference: Mapping[str, FloatArray],
    *,
    judged: bool = True,
) -> list[Difference]:
    """Compare outputs with their references.

    Parameters
    ----------
    outputs : sequence of Output
        Those without a reference are left out.
    values, reference : mapping of str to float64 (n,)
        By name, in the outputs' units; NaN in the reference: none there.
    judged : bool
        Whether tolerances count (they are of fixed point against float, not against truth).
    """
    by_name = {o.name: o for o in outputs}
    whole = all(name in by_name and name in reference for name in QUATERNION)
    turned = dict(reference)
    out = []
    alike = _alike(outputs, values, reference) if judged else None
    with np.errstate(all="ignore"):  # a reference may be infinite
        if whole:
            q, r = (np.stack([x[n] for n in QUATERNION], axis=-1) for x in (values, reference))
            sign = np.where((q * r).sum(axis=-1) < 0.0, -1.0, 1.0)
            turned |= {n: reference[n] * sign for n in QUATERNION}
        for o in outputs:
            if o.name in reference:
                exact = o.unit in EXACT_UNITS
                tolerance = (0.0 if exact else o.tolerance) if judged else None
                error = _apart(o.unit, values[o.name], turned[o.name])
                # A truth may have gaps; a float64 run that is no number is a fault.
                there = judged | np.isfinite(turned[o.name])
                if exact:
                    made = _difference(o.name, "words", error, there, tolerance)
                    out.append(replace(made, decided=_decided(o, error)) if judged else made)
                else:
                    out.append(_difference(o.name, o.unit, error, there, tolerance, alike))
        if whole:
            limits = [by_name[n].tolerance for n in QUATERNION] if judged else [None]
            known = [x for x in limits if x is not None]
            # An angle a differs by a/2 in the quaternion, of length at most twice a component's.
            limit = math.degrees(4.0 * max(known)) if len(known) == len(limits) else None
            known_there = judged | np.isfinite(r).all(axis=-1)
            angle = np.degrees(_angle(q, r))
            out.append(_difference(ATTITUDE, "deg", angle, known_there, limit, alike))
    return out


def _alike(
    outputs: Sequence[Output], values: Mapping[str, FloatArray], reference: Mapping[str, FloatArray]
) -> int | None:
    """Leading updates whose decisions agree; None: all."""
    exact = [o for o in outputs if o.unit in EXACT_UNITS and o.name in reference]
    differ = [_apart(o.unit, values[o.name], reference[o.name]) != 0.0 for o in exact]
    wrong = np.logical_or.reduce(differ) if differ else np.zeros(0, dtype=np.bool_)
    return int(wrong.argmax()) if wrong.any() else None


def _decided(output: Output, error: FloatArray) -> Decided:
    differing = error != 0.0
    ends = np.flatnonzero(np.diff(np.concatenate([[False], differing, [False]]).astype(np.int8)))
    longest = int(np.diff(ends)[::2].max(initial=0))
    count = int(np.count_nonzero(differing))
    return Decided(count, len(error), longest, output.share, output.longest)


def _apart(unit: str, values: FloatArray, reference: FloatArray) -> FloatArray:
    if unit in EXACT_UNITS:
        return np.where(
            np.isnan(values) | ~np.isfinite(reference),
            np.nan,
            np.rint(values) != np.rint(reference),
        )
    error = np.abs(values - reference)
    return around(error, PERIODS[unit]) if unit in PERIODS else error


def around(error: FloatArray, period: float) -> FloatArray:
    """Distances on a circle of so much."""
    half = 0.5 * period
    return np.abs((error + half) % period - half)


def _angle(q: FloatArray, r: FloatArray) -> FloatArray:
    """Angle [rad] of the rotation between quaternions (n, 4), of norms near 1; else half a turn."""
    w, *v = np.moveaxis(quaternion_multiply(q, quaternion_conjugate(r)), -1, 0)
    angle = 2.0 * np.arctan2(np.linalg.norm(v, axis=0), np.abs(w))
    none = np.abs(np.log(np.linalg.norm(np.stack([q, r]), axis=-1))).max(axis=0) > _NORMS
    return np.asarray(np.where(none, math.pi, angle), dtype=np.float64)


def _difference(
    name: str,
    unit: str,
    error: FloatArray,
    known: npt.ArrayLike,
    tolerance: float | None,
    alike: int | None = None,
) -> Difference:
    """Of leading samples, and after them; all of them for None."""
    there = np.broadcast_to(np.asarray(known, dtype=np.bool_), error.shape)
    curve = np.where(there, error, np.nan)
    if alike is not None:
        before = _difference(name, unit, error[:alike], there[:alike], tolerance)
        rest = _difference(name, unit, error[alike:], there[alike:], None)
        step = None if rest.at_step is None else rest.at_step + alike
        return replace(before, apart=curve, after=replace(rest, at_step=step))
    if not there.any():
        return Difference(name, unit, 0, math.nan, math.nan, None, tolerance, curve)
    seen = error[there]
    broken = np.isnan(seen)
    k = int(np.argmax(broken if broken.any() else seen))
    return Difference(
        name,
        unit,
        int(there.sum()),
        float(seen[k]),
        float(np.sqrt(np.mean(seen**2))),
        int(np.flatnonzero(there)[k]),
        tolerance,
        curve,
    )
