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
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.declarations import (
    ATTITUDE,
    ATTITUDE_DEG,
    EXACT_UNITS,
    PERIODS,
    QUATERNION,
    Output,
)
from boresight.sim.rotations.accuracy import attitude_of
from boresight.sim.rotations.rotation import quaternion_conjugate, quaternion_multiply
from boresight.sim.rotations.zyx import wrapped

_NORMS = math.log(2.0)  #: Natural logarithm of a quaternion's norm that is no attitude's.
_WHOLE = ""  #: Key of the attitude that four outputs are: an output may be called attitude, too.
#: A whole turn in the units of angles that are not compared modulo it.
TURNS = {"deg": 360.0, "rad": 2.0 * math.pi}
MODULO = "declare state and output in ht, which is compared modulo a turn"  #: Remedy of a turn.


@dataclass(frozen=True)
class Difference:
    """How far an output lies from its reference."""

    output: str
    unit: str  #: deg of ``ATTITUDE``, the angle between two quaternions; of decisions "words".
    samples: int  #: compared; those without a reference are left out, and those in ``after``.
    largest: float  #: NaN where a value is none, as ``rms``.
    rms: float
    at_step: int | None  #: sample of the largest.
    tolerance: float | None  #: largest accepted error; None: not judged by it.
    #: Of an error against truth the largest accepted root mean square (`Output.truth`), infinite
    #: where none is declared; else None.
    limit: float | None = None
    #: Of every sample, where they are kept; NaN where there is no reference, or no number.
    apart: FloatArray = field(default_factory=lambda: np.zeros(0), repr=False, compare=False)
    decided: Decided | None = None  #: of decisions, how many differ.
    #: The samples from the first decision that differs on, judged by their root mean square.
    after: Difference | None = None
    #: First sample beyond the tolerance, where there is one.
    beyond: int = field(default=0, repr=False, compare=False)
    #: Errors against truth of about one turn or several, if most beyond half a turn are such.
    turned: int = field(default=0, repr=False, compare=False)

    @property
    def first_beyond(self) -> int | None:
        """First sample beyond the tolerance; None if all are within it."""
        return None if self.good else self.beyond

    @property
    def good(self) -> bool:
        """Not judged, or within the tolerance over at least one sample; NaN is beyond any."""
        if self.limit is not None:
            return self.limit == math.inf or self.rms <= self.limit
        if self.tolerance is None or not self.samples:
            return self.tolerance is None
        if self.decided is not None:
            return math.isfinite(self.largest) and self.decided.good
        steady = self.after is None or self.after.rms <= self.tolerance
        return self.largest <= self.tolerance and steady

    def to_json(self) -> dict[str, Any]:
        return {
            "output": self.output,
            "unit": self.unit,
            "samples": self.samples,
            "max": self.largest if math.isfinite(self.largest) else None,
            "rms": self.rms if math.isfinite(self.rms) else None,
            "at_step": self.at_step,
            "tolerance": self.tolerance if self.limit in (None, math.inf) else self.limit,
            "good": self.good,
            **({} if self.decided is None else {"decisions": asdict(self.decided)}),
            **({} if self.after is None else {"after": self.after.to_json()}),
        }

    def line(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        if self.limit is not None:
            verdict = f"{'within' if self.good else 'BEYOND'} {self.limit:.3g}"
            verdict = "not judged" if self.limit == math.inf else verdict
            text = f"rms {self.rms:.3g}{unit}, max {self.largest:.3g}{unit}"
            return f"{self.output:12s} {text}: {verdict}"
        if self.decided is not None and self.decided.differing and math.isfinite(self.largest):
            verdict = "within what is accepted" if self.good else "BEYOND what is accepted"
            return f"{self.output:12s} {self.decided} from step {self.at_step} on: {verdict}"
        if self.tolerance is None:
            verdict = "not judged"
        else:
            verdict = f"{'within' if self.good else 'BEYOND'} {self.tolerance:.3g}"
            if not self.good and f"{self.largest:.3g}" == f"{self.tolerance:.3g}":
                verdict += f", by {self.largest - self.tolerance:.1g}"
            if self.output == ATTITUDE and self.largest == 180.0:
                verdict += ": one has a norm beyond 0.5 to 2, or is half a turn off"
        where = "" if self.at_step is None else f" in step {self.at_step}"
        text = f"max {self.largest:.3g}{unit}{where}, rms {self.rms:.3g}"
        if self.after is not None:
            text += f"; in {self.after.samples} updates after a decision that differs, max "
            text += f"{self.after.largest:.3g} in step {self.after.at_step}, rms "
            text += f"{self.after.rms:.3g}"
        return f"{self.output:12s} {text}: {verdict}"


@dataclass
class Decided:
    """Decisions that differ, row by row: updates, most in a row, and what is accepted."""

    differing: int
    of: int
    longest: int
    most_share: float
    most_longest: int
    _running = 0

    def add(self, differing: BoolArray) -> None:
        edges = np.flatnonzero(np.diff(np.concatenate([[0], differing.astype(np.int8), [0]])))
        lengths = np.diff(edges)[::2]
        if len(lengths) and differing[0]:
            lengths[0] += self._running
        self._running = int(lengths[-1]) if len(lengths) and differing[-1] else 0
        self.longest = max(self.longest, int(lengths.max(initial=0)))
        self.differing += int(np.count_nonzero(differing))
        self.of += len(differing)

    @property
    def good(self) -> bool:
        share = self.differing / self.of
        return share <= self.most_share and self.longest <= self.most_longest

    def __str__(self) -> str:
        return (
            f"{self.differing} of {self.of} decisions differ, a share of "
            f"{self.differing / self.of:.2g} (accepted {self.most_share:.2g}), up to "
            f"{self.longest} in a row (accepted {self.most_longest})"
        )


def differences(
    outputs: Sequence[Output],
    values: Mapping[str, FloatArray],
    reference: Mapping[str, FloatArray],
    *,
    judged: bool = True,
) -> list[Difference]:
    """Compare outputs with their references, which are there whole; see `Differences`."""
    made = Differences(outputs, reference, judged=judged, curves=True)
    made.add(values, reference)
    return made.result()


def turn_notes(truth: Iterable[Difference]) -> list[str]:
    """Lines about angles whose errors against truth are whole turns."""
    return [
        f"{d.output}: its error against {d.output}_true is about a whole turn in {d.turned} of "
        f"{d.samples} samples; {MODULO}"
        for d in truth
        if d.turned
    ]


def unjudged(outputs: Sequence[Output], known: Collection[str]) -> list[str]:
    """Lines about outputs with a limit against truth, without a true value: not ``known``."""
    return [
        f"{o.name}: truth={o.truth:g} is not judged: no true value of it is given, {o.name}_true"
        for o in outputs
        if o.truth is not None and o.name not in known
    ]


class Differences:
    """Outputs beside their references, piece by piece: the same figures whatever the pieces.

    Outputs whose names are not among ``references`` are left out. ``judged``: references are
    float64's, and tolerances count; else they are true values. ``curves``: `Difference.apart` is
    kept.
    """

    def __init__(
        self,
        outputs: Sequence[Output],
        references: Collection[str],
        *,
        judged: bool = True,
        curves: bool = False,
    ) -> None:
        self._outputs = [o for o in outputs if o.name in references]
        self._judged, self._rows, self._parted = judged, 0, False
        self._accounts = {o.name: _Account(o, judged, curves) for o in self._outputs}
        if self._accounts.keys() >= {*QUATERNION}:
            limits = [self._accounts[n].tolerance for n in QUATERNION]
            known = [x for x in limits if x is not None]
            limit = ATTITUDE_DEG * max(known) if len(known) == len(limits) else None
            declared = Output(ATTITUDE, unit="deg", tolerance=limit)
            self._accounts[_WHOLE] = _Account(declared, judged, curves)

    def add(self, values: Mapping[str, FloatArray], reference: Mapping[str, FloatArray]) -> None:
        """The next rows: (n,) by name, in the outputs' units; NaN in the reference: none there."""
        turned = dict(reference)
        with np.errstate(all="ignore"):  # a reference may be infinite
            if has_attitude := _WHOLE in self._accounts:
                q, r = attitude_of(values), attitude_of(reference)
                sign = np.where((q * r).sum(axis=-1) < 0.0, -1.0, 1.0)
                turned |= {n: reference[n] * sign for n in QUATERNION}
            errors = {o.name: apart(o.unit, values[o.name], turned[o.name]) for o in self._outputs}
            known = {name: np.isfinite(turned[name]) for name in errors}
            if has_attitude:
                errors[_WHOLE] = np.degrees(_angle(q, r))
                known[_WHOLE] = np.logical_and.reduce(np.isfinite(r), axis=-1)
            cut = self._cut(errors)
            for name, error in errors.items():
                # A truth may have gaps; a float64 run that is no number is a fault.
                counted = self._judged | known[name]
                self._accounts[name].add(error, counted, self._rows, cut)
        self._rows += len(next(iter(errors.values()), ()))

    def result(self) -> list[Difference]:
        """One for each output that has a reference, and last the attitude, of all rows so far."""
        return [account.result() for account in self._accounts.values()]

    def _cut(self, errors: Mapping[str, FloatArray]) -> int | None:
        """Leading rows of a piece before the first decision that differs; None: all."""
        if self._judged and not self._parted:
            differ = [errors[o.name] != 0.0 for o in self._outputs if o.unit in EXACT_UNITS]
            wrong = np.logical_or.reduce(differ) if differ else np.zeros(0, dtype=np.bool_)
            self._parted = bool(wrong.any())
            return int(wrong.argmax()) if self._parted else None
        return 0 if self._parted else None


class _Account:
    """One output, as far as it has been compared."""

    def __init__(self, output: Output, judged: bool, curves: bool) -> None:
        self.output, self.exact = output, output.unit in EXACT_UNITS
        limit = 0.0 if self.exact else output.tolerance
        self.tolerance = limit if judged else None
        self.limit = None if judged else output.truth or math.inf
        self._before, self._after = Spread(), Spread()
        self._parted = False
        self._turn = math.inf if judged else TURNS.get(output.unit, math.inf)
        self._far = self._turned = 0  # samples beyond half a turn, and those near whole ones
        self._beyond: int | None = None
        self._curves: list[FloatArray] | None = [] if curves else None
        accepted = output.share, output.longest
        self._decided = Decided(0, 0, 0, *accepted) if self.exact and judged else None

    def add(self, error: FloatArray, counted: BoolArray, start: int, cut: int | None) -> None:
        """The next rows, of which those from ``cut`` on follow a decision that differs."""
        cut = None if self.exact else cut
        self._before.add(error[:cut], counted[:cut], start)
        if cut is not None:
            self._parted = True
            self._after.add(error[cut:], counted[cut:], start + cut)
        far = error[counted & (error > 0.5 * self._turn)]
        self._far += len(far)
        self._turned += int((np.abs(wrapped(far, self._turn)) < 0.125 * self._turn).sum())
        if self._beyond is None and self.tolerance is not None:
            wrong = ~(counted & (error <= self.tolerance))
            self._beyond = start + int(np.argmax(wrong)) if wrong.any() else None
        if self._curves is not None:
            self._curves.append(np.where(counted, error, np.nan))
        if self._decided is not None:
            self._decided.add(error != 0.0)

    def result(self) -> Difference:
        name, unit = self.output.name, "words" if self.exact else self.output.unit
        made, after = (
            Difference(name, unit, f.samples, f.largest, f.rms, f.at_step, limit)
            for f, limit in ((self._before, self.tolerance), (self._after, None))
        )
        return replace(
            made,
            limit=self.limit,
            apart=np.concatenate(self._curves) if self._curves else made.apart,
            decided=None if self._decided is None else replace(self._decided),
            after=after if self._parted else None,
            beyond=self._beyond or 0,
            turned=self._turned if self._turned >= 0.9 * self._far else 0,
        )


_SUMMED = 1 << 16  #: Squares that are summed at a time: rows of a short log as one.


class Spread:
    """Number, largest and root mean square of some rows; NaN is the largest."""

    def __init__(self) -> None:
        self.samples, self.largest = 0, math.nan
        self.at_step: int | None = None
        self._sums: list[float] = []
        self._rest = np.zeros(0)

    def add(self, error: FloatArray, counted: BoolArray, start: int) -> None:
        """The next rows, the first of which is row ``start``."""
        seen = error[counted]
        if not len(seen):
            return
        if self.at_step is None or not math.isnan(self.largest):
            broken = np.isnan(seen)
            k = int(np.argmax(broken if broken.any() else seen))
            if not seen[k] <= self.largest:  # or that is none yet
                self.largest = float(seen[k])
                self.at_step = start + int(np.flatnonzero(counted)[k])
        self.samples += len(seen)
        self._rest = np.concatenate([self._rest, seen**2])
        while len(self._rest) >= _SUMMED:
            self._sums.append(float(np.sum(self._rest[:_SUMMED])))
            self._rest = self._rest[_SUMMED:]

    @property
    def rms(self) -> float:
        """Root mean square; NaN of nothing."""
        total = np.sum([*self._sums, float(np.sum(self._rest))])
        return float(np.sqrt(total / self.samples)) if self.samples else math.nan


def apart(unit: str, values: FloatArray, reference: FloatArray) -> FloatArray:
    """Distance of values from a reference; of words whether they differ."""
    if unit in EXACT_UNITS:
        return np.where(
            np.isnan(values) | ~np.isfinite(reference),
            np.nan,
            np.rint(values) != np.rint(reference),
        )
    error = np.abs(values - reference)
    return np.abs(wrapped(error, PERIODS[unit])) if unit in PERIODS else error


def _angle(q: FloatArray, r: FloatArray) -> FloatArray:
    """Angle [rad] of the rotation between quaternions (n, 4), of norms near 1; else half a turn."""
    w, *v = np.moveaxis(quaternion_multiply(q, quaternion_conjugate(r)), -1, 0)
    angle = 2.0 * np.arctan2(np.linalg.norm(v, axis=0), np.abs(w))
    none = np.abs(np.log(np.linalg.norm(np.stack([q, r]), axis=-1))).max(axis=0) > _NORMS
    return np.asarray(np.where(none, math.pi, angle), dtype=np.float64)
