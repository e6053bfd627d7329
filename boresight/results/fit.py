"""Result of `boresight fit`, and its text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from boresight.sim.answer import Answer
from boresight.sim.compare.diagnosis import NAMED, Wasted
from boresight.sim.fit.fitting import WORSE

__all__ = ["FitError", "FitLimit", "FitResult"]


@dataclass(frozen=True)
class FitError:
    """Largest difference between fixed point and float64 on the records, of one output.

    Attributes
    ----------
    output, unit : str
    before, after : float or None
        With formats by intervals, and by the profile; None: it does not compile so.
    tolerance : float or None
        What its author accepts; None: not judged.
    """

    output: str
    unit: str
    before: float | None
    after: float | None
    tolerance: float | None = None

    @property
    def verdict(self) -> str:
        """What is wrong with the profile's: beyond the tolerance, or larger than before."""
        if self.after is None:
            return ""
        text = ""
        if self.tolerance is not None and self.after > self.tolerance:
            text = f", BEYOND {self.tolerance:g}"
        return text + ", less exact with it" * self.worse

    @property
    def worse(self) -> bool:
        """Whether it is larger than before."""
        if self.before is None or self.after is None:
            return False
        return self.after > WORSE * self.before

    def change(self) -> str:
        """Before and after, for people."""
        numbers = ("-" if x is None else f"{x:.3g}" for x in (self.before, self.after))
        return f"{self.output} {' to '.join(numbers)} {self.unit}".rstrip()


@dataclass(frozen=True)
class FitLimit:
    """A divisor, or the argument of a root, that the profile holds off zero.

    Attributes
    ----------
    line : str
        Where its author wrote the division or root.
    low, high : float
        Where it is held, really: by a comparison.
    """

    line: str
    low: float
    high: float


def succeeded(saturated_updates: int, negative_updates: tuple[int | None, int]) -> bool:
    """Whether nothing saturated in the records, and the profile makes no variance negative.

    Both as in `FitResult`.
    """
    before, after = negative_updates
    return not saturated_updates and after <= (before or 0)


@dataclass(frozen=True)
class FitResult(Answer):
    """What `fit` gives.

    Attributes
    ----------
    estimator : str
    profile : Path
        The file; not written unless ``good``.
    records : mapping of str to int
        Updates by the name of the log or world.
    hostile_updates : int
    values : int
        Numbers that the step computes.
    formats : int
        Those whose format the profile chooses.
    limits : tuple of FitLimit
    errors : tuple of FitError
        By output, of a word of ``word`` bits.
    dropped : tuple of FitError
        With every format from runs, where some or all of them were left out for that.
    saturated_updates : int
        Of the records, with the profile.
    negative_updates : tuple of (int or None, int)
        Of hostile updates, those after which a variance is negative, without the profile (None: it
        does not compile so) and with it.
    refused : str
        Why nothing compiles without the profile; empty where it does.
    word : int
    cycles : tuple of ((int, int) or None)
        Latency and interval on `small` without the profile and with it, by one pass of the
        scheduler; None where it does not compile so, or has no place.
    wasted : tuple of Wasted
        Inputs, states and claims whose ranges waste bits on the records, the worst first.
    """

    estimator: str
    profile: Path
    records: Mapping[str, int]
    hostile_updates: int
    values: int
    formats: int
    limits: tuple[FitLimit, ...]
    errors: tuple[FitError, ...]
    saturated_updates: int
    negative_updates: tuple[int | None, int]
    refused: str
    word: int
    cycles: tuple[tuple[int, int] | None, tuple[int, int] | None] = (None, None)
    dropped: tuple[FitError, ...] = ()
    wasted: tuple[Wasted, ...] = ()

    @property
    def good(self) -> bool:
        """Nothing saturated in the records, and the profile makes no variance negative."""
        return succeeded(self.saturated_updates, self.negative_updates)

    def __str__(self) -> str:
        runs = ", ".join(f"{name} ({count} updates)" for name, count in self.records.items())
        lines = [
            f"{self.profile}: {self.formats} formats of {self.values} values, from {runs} and "
            f"{self.hostile_updates} hostile updates"
        ]
        if self.refused:
            lines.append(f"  without it: {self.refused}")
        for e in self.errors:
            unit = f" {e.unit}" if e.unit else ""
            before = "-" if e.before is None else f"{e.before:.3g}"
            after = "-" if e.after is None else f"{e.after:.3g}"
            lines.append(
                f"  fixed against float64: {e.output:12s} max {before}{unit}, with it {after}{unit}"
                + e.verdict
            )
        before_cycles, cycles = self.cycles
        if cycles is not None:
            earlier = before_cycles or ("-", "-")
            lines.append(
                f"  small, by one pass of the scheduler: latency {earlier[0]} cycles, with it "
                f"{cycles[0]}; interval {earlier[1]}, with it {cycles[1]}"
            )
        if self.formats and self.errors and all(e.before == e.after for e in self.errors):
            lines.append("  no error changes: the profile gains nothing in these records")
        if self.dropped:
            worse = [e.change() for e in self.dropped if e.worse] or ["variances, or saturations"]
            left = "those that gain most are kept" if self.formats else "none is kept"
            lines.append(
                f"  with every format from runs less exact: {', '.join(worse)}; {left} "
                "(docs/learn/ranges.md, what a profile cannot mend)"
            )
        lines += dict.fromkeys(
            f"  {x.line}: held in [{x.low:.3g}, {x.high:.3g}], which no interval shows"
            for x in self.limits
        )
        lines += [f"  {w}" for w in self.wasted[:NAMED]]
        if self.saturated_updates:
            lines.append(
                f"FAILED, not written: {self.saturated_updates} updates SATURATED in the records; "
                "boresight check names the first value"
            )
        elif not self.good:
            bare, fit = self.negative_updates
            without = "" if bare is None else f", {bare} without it"
            lines.append(
                "FAILED, not written: a variance is NEGATIVE after "
                f"{fit} hostile updates{without}: declare the ranges of the covariance's values "
                "with ops.bounded"
            )
        return "\n".join(lines)
