"""A record as one estimator's inputs: columns by name, converted and checked once."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from inspect import signature
from itertools import pairwise
from pathlib import Path

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray, IntArray
from boresight.model.declarations import EXACT_UNITS, QUATERNION, Input
from boresight.model.errors import InputError, require
from boresight.model.estimator import Estimator, input_words
from boresight.model.step import called
from boresight.model.units import linear
from boresight.model.words.program import Program
from boresight.sim.records.files import Log, recording_of
from boresight.sim.records.plausible import warnings_of
from boresight.sim.records.reader import InputReader
from boresight.sim.records.record import (
    ROWS,
    TRUTH,
    Column,
    Place,
    Record,
    check_norm,
    rows_of,
    truth_names,
)
from boresight.sim.records.selection import Clock, selection

#: Share by which a record's rate may differ from the one that an estimator is designed for.
RATE_TOLERANCE = 0.02
#: Longest gap whose length is told, as a share of the range of dt below 0.
_LEAST = 0.96
#: Units that a column of times may have been meant in, in seconds.
_TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


@dataclass(frozen=True, eq=False)
class Feed:
    """Inputs of an estimator, from a record, with what else its samples have."""

    record: Record
    t: FloatArray | None  #: (n,): times in seconds; None if the record has none.
    inputs: FloatArray  #: (n, n_inputs): in the declared units, clamped to the declared ranges.
    new: BoolArray  #: (n, n_inputs): whether the record has a new sample.
    clamped: dict[str, int]  #: samples so far beyond the range of inputs that are to be clamped.
    truth: dict[str, FloatArray]  #: (n,): true values by output name, in its unit; NaN: none.
    counts: BoolArray  #: (n,): samples that count in an error: where ``mov`` is not 0, or all.
    #: (n,): samples that begin from the initial states: where a column ``restart``, which is no
    #: input of the estimator, is above 0.
    restarts: BoolArray
    notes: tuple[str, ...]  #: warnings about times, up to here.
    #: Gives warnings about implausible values: examining them takes longer than many a run.
    doubts: Callable[[], tuple[str, ...]] = tuple

    @property
    def warnings(self) -> tuple[str, ...]:
        """About times and implausible values, up to here."""
        return (*self.notes, *self.doubts())

    def __len__(self) -> int:
        return len(self.inputs)

    @property
    def step_s(self) -> float | None:
        """Median of the time steps above 0 of the record, in s; None without times."""
        has_steps = _timed(self.record) and len(self.record) > 1
        steps = self.record.steps() if has_steps else np.zeros(0)
        return float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else None

    def rows(self, start: int, stop: int) -> Feed:
        """Some rows, with the counts and warnings of all."""
        span = slice(start, stop)
        return replace(
            self,
            t=None if self.t is None else self.t[span],
            inputs=self.inputs[span],
            new=self.new[span],
            truth={n: v[span] for n, v in self.truth.items()},
            counts=self.counts[span],
            restarts=self.restarts[span],
        )

    def parts(self) -> Iterator[Feed]:
        """The rows, `ROWS` at a time."""
        for start in range(0, len(self), ROWS):
            yield self.rows(start, min(start + ROWS, len(self)))

    def spans(self, anew: bool) -> Iterator[tuple[FloatArray, bool]]:
        """Inputs from one restart to the next, and whether they begin from the initial states.

        ``anew``: whether the first row does.
        """
        starts = sorted({0, *np.flatnonzero(self.restarts).tolist()})
        for start, stop in pairwise([*starts, len(self)]):
            first = bool(self.restarts[start]) if start < len(self) else False
            yield self.inputs[start:stop], first or (anew and not start)

    def words(self, program: Program) -> IntArray:
        """Input words (n, n_inputs)."""
        return input_words(program, self.inputs[:, :, None])[:, :, 0]


def feed(estimator: Estimator, record: Record) -> Feed:
    """An estimator's inputs, selected, converted and checked.

    InputError for no column, a unit of another dimension, a missing sample, a value outside the
    declared range, or a sample rate other than the estimator's.
    """
    return Feeder(estimator).take(record)


def feeds(estimator: Estimator, records: Iterable[Record]) -> Iterator[Feed]:
    """`feed` of a record in pieces; see `Feeder`."""
    return map(Feeder(estimator).take, records)


@dataclass(frozen=True, eq=False)
class LongFeed:
    """Inputs of an estimator from a long log, of which one part at a time is in memory."""

    estimator: Estimator
    log: Log

    def __len__(self) -> int:
        """Count the samples; the log is read for it."""
        return len(self.log)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the first rows."""
        return next(self.parts()).warnings

    def parts(self) -> Iterator[Feed]:
        """The rows, `ROWS` at a time; of a long log it is read and checked each time."""
        return feeds(self.estimator, self.log.blocks(ROWS))


def feed_of(estimator: Estimator, log: Log) -> Feed | LongFeed:
    """The inputs of an estimator from a log; raises InputError as `feed`, of one in memory."""
    return feed(estimator, log.data) if isinstance(log.data, Record) else LongFeed(estimator, log)


class Feeder:
    """`feed` of a record in pieces; the rate is that of the first."""

    def __init__(self, estimator: Estimator) -> None:
        if selection().gaps == "restart" and not estimator.restarts:
            wanted = "an estimator that a time step below 0 restarts (restarts = True)"
            fix = "leave --gaps out if its dt may be as long, or choose rows by --from and --to"
            raise InputError.at("--gaps restart", wanted=wanted, found=estimator.name, fix=fix)
        self.estimator = estimator
        self._start, self._place = 0, Place("")
        self._clock: Clock | None = None
        self._notes = dict[str, None]()
        self._misspelt = list[str]()
        self._doubts: Callable[[], tuple[str, ...]] = tuple

        def place(row: int, _: int, name: str) -> str:
            return self._place(row - self._start, name)

        self._reader = InputReader(estimator, place)

    def take(self, record: Record) -> Feed:
        """The next piece."""
        estimator, reader = self.estimator, self._reader
        self._start = reader.rows
        if not self._start:
            record = self._complete(record)
            _refuse_missing(estimator, record)
            _refuse_rate(estimator, record)
        by_time = record.place.by_time or "dt" not in record.columns
        self._place = replace(record.place, by_time=by_time)
        _refuse_two_clocks(record)
        own = (i for i in estimator.inputs if not i.flags)
        columns = {i.name: self._values(record, i)[:, None] for i in own}
        all_inputs, all_new = reader.take(columns, len(record))
        inputs, new = all_inputs[:, 0], all_new[:, 0]
        truth = _truth(estimator, record)
        t = record.values("t", "s") if "t" in record.columns else None
        counts, begins = np.ones(len(record), dtype=bool), np.zeros(len(record), dtype=bool)
        if "mov" in record.columns:
            counts = record.numbers("mov") != 0.0
        if "restart" in record.columns:
            begins = record.numbers("restart") > 0.0
            if any(i.name == "restart" for i in estimator.inputs) and begins.any():
                text = f"column restart is an input of {estimator.name}: no row restarts it"
                self._notes[f"{text}; rename the input if rows are to"] = None
                begins = np.zeros_like(begins)
        if not self._start:
            clamped, self._misspelt = dict(reader.clamped), [*_misspelt(estimator, record)]
            units = {name: column.unit for name, column in record.columns.items()}
            told = partial(warnings_of, estimator, inputs, new, truth, clamped, units)
            self._doubts = cache(told)
        notes = self._warnings(record)
        return Feed(
            record, t, inputs, new, reader.clamped, truth, counts, begins, notes, self._doubts
        )

    def _complete(self, record: Record) -> Record:
        """A slice from the first row on in which every held input has had a sample."""
        held = [i.name for i in self.estimator.inputs if i.missing == "hold"]
        known = {n: ~np.isnan(record.numbers(n)) for n in held if n in record.columns}
        late = {n: int(np.argmax(k)) for n, k in known.items() if k.any() and not k[0]}
        if not late or not selection().sliced:
            return record
        start = max(late.values())
        note = f"{', '.join(late)}: no sample at the start of the slice; rows left out: {start}"
        self._notes[note] = None
        return rows_of(record, start, len(record))

    def _warnings(self, record: Record) -> tuple[str, ...]:
        """Warnings about times and columns up to now: gaps are counted in all pieces."""
        is_first = not self._start
        self._notes |= dict.fromkeys(record.notes)
        if self.estimator.states and _timed(record) and not selection().gaps:
            if is_first and len(record) > 2:
                self._clock = Clock.of_steps(record.steps()[1:])
            elif self._clock is not None:
                self._clock = self._clock.extended(record.steps())
        lines = [] if self._clock is None else [*_irregular_steps(self.estimator, self._clock)]
        notes = [n for n in self._notes if not any(line.startswith(n) for line in lines)]
        return (*notes, *lines, *self._misspelt)

    def _values(self, record: Record, declared: Input) -> FloatArray:
        """Values of an input's column in its unit, NaN where there is no new sample.

        A gap is told as a board does: by the time step that restarts or bridges the filter.
        """
        if declared.name != "dt":
            return record.values(declared.name, declared.unit)
        columns = {"dt": Column(record.steps(), "s")} | dict(record.columns)
        steps = record.derived(columns).values("dt", declared.unit)
        steps = _at_limits(declared, record, steps)
        if not (self.estimator.restarts and declared.low < 0.0) or selection().gaps:
            return steps
        told = np.maximum(declared.high - steps, _LEAST * declared.low)
        return np.where(steps > declared.high, told, steps)


def fitted(estimator: Estimator, record: Record) -> Estimator:
    """Return the estimator for the sample rates of a record."""
    if not estimator.rates_hz or not _timed(record):
        return estimator
    rate = _rate_hz(record)
    shares = {
        i.name: float(np.mean(~np.isnan(record.columns[i.name].values)))
        for i in estimator.inputs
        if i.name in record.columns
    }
    rates = {name: rate * share for name, share in shares.items() if share}
    return called(
        estimator.for_rates,
        rates | {"dt": rate},
        where=f"estimator {estimator.name}, for_rates",
        wanted="the estimator for sample rates",
        kind=Estimator,
        answer="return an estimator, or self",
    )


def _timed(record: Record) -> bool:
    return "t" in record.columns or "dt" in record.columns


def _rate_hz(record: Record) -> float:
    return 1.0 / max(float(np.median(record.steps())), 1e-9)


def _irregular_steps(estimator: Estimator, clock: Clock) -> Iterator[str]:
    """Warnings about gaps and jitter of the times, and what the estimator makes of them."""
    every = selection().every
    timed = any(i.name == "dt" or i.unit in _TIME_UNITS for i in estimator.inputs)
    if every > 1 and not timed and "dt" not in estimator.rates_hz:
        text = f"--every {every}: {estimator.name} has no input dt and no rates_hz"
        yield f"{text}, and counts {every} rows as one step"
    does = "takes each as one long step" if timed else "has no input dt, and counts each as one"
    for dt in (i for i in estimator.inputs if i.name == "dt" and i.low < 0.0):
        longest_s = dt.high * _TIME_UNITS.get(dt.unit, 1.0)
        if estimator.restarts and clock.longest_s > 1.000001 * longest_s:
            most_s = max(longest_s, estimator.bridges_s)
            does = f"restarts after those above {most_s:g} s"
            if clock.longest_s <= estimator.bridges_s:
                does = f"bridges those above {longest_s:g} s"
    for note in clock.notes(jitter=not timed):
        yield f"{note}: {estimator.name} {does}"


def _refuse_two_clocks(record: Record) -> None:
    """Refuse a column dt, or a rate fs, that contradicts the times."""
    if not {"t", "dt"} <= {*record.columns} or len(record) < 3:
        return
    steps, dt = np.diff(record.values("t", "s")), record.values("dt", "s")[1:]
    known = dt > 0.0
    if not known.any():
        return
    by_t, by_dt = float(np.median(steps[known])), float(np.median(dt[known]))
    wanted, fix = "dt (or fs) and the differences of t that agree", "leave one of them out"
    found = f"steps of {by_dt:.6g} s, and times {by_t:.6g} s apart"
    good = abs(by_dt / by_t - 1.0) <= RATE_TOLERANCE
    require(good, record.where, wanted, found, f"{fix}, or correct its unit")


def _refuse_rate(estimator: Estimator, record: Record) -> None:
    """Refuse a record at another rate, with the unit that its times are probably in."""
    if "dt" not in estimator.rates_hz or not _timed(record):
        return
    rate, name = _rate_hz(record), "t" if "t" in record.columns else "dt"
    unit = record.columns[name].unit or "s"
    seconds = linear(unit, "s")[0] * rate / estimator.rates_hz["dt"]
    near = [u for u, s in _TIME_UNITS.items() if abs(seconds / s - 1.0) <= RATE_TOLERANCE]
    if near and near != [unit]:
        fix = f"the column {name} is probably in {near[0]}: write {name}[{near[0]}] in the header"
    elif "rate_hz" in signature(type(estimator)).parameters:
        fix = f"make it with rate_hz={rate:.6g}"
    else:
        fix = "use a log at its rate (--every thins one that is faster), or design its gains for "
        fix += f'that of the log and declare rates_hz = {{"dt": {rate:.6g}}}'
    require_rate(estimator, rate, record.where, fix)


def require_rate(estimator: Estimator, rate_hz: float, where: str, fix: str) -> None:
    """Refuse a number of samples a second that the estimator is not made for."""
    made_for = estimator.rates_hz.get("dt", rate_hz)
    if abs(rate_hz / made_for - 1.0) > RATE_TOLERANCE:
        wanted = f"{made_for:g} samples a second, for which {estimator.name} is made"
        raise InputError.at(where, wanted=wanted, found=f"{rate_hz:.6g}", fix=fix)


#: Longest list of inputs that is shown as wanted, in characters.
_NAMES = 90
#: Names that others give to the column of times.
_TIMES = ("t", "time", "times", "timestamp", "time_s", "seconds")


def _refuse_missing(estimator: Estimator, record: Record) -> None:
    """InputError for all inputs without a column, with the columns that may be meant."""
    columns = [c for c in record.columns if c != "dt" or "t" not in record.columns]
    missing = [i for i in estimator.inputs if not i.flags and i.name not in columns]
    missing = [i for i in missing if i.name != "dt" or "t" not in columns]
    if not missing:
        return
    hints, words = dict[str, str](), {c: re.split(r"\W", c.lower())[0] for c in columns}
    time = next((c for c in columns if words[c] in _TIMES), None)
    for i in missing:
        lower = i.name.lower()
        near = next((c for c in columns if words[c] == lower), None)
        if near:
            unit = record.columns[near].unit or ("" if near.lower() == lower else "UNIT")
            hints[near] = i.name + (f"[{unit}]" if unit else "")
        elif time and i.name == "dt":
            unit = "" if time.lower() in _TIMES else "[UNIT]"
            hints[time] = f"t{unit} (dt is its difference)"
    names = [
        "t [s] or " * (i.name == "dt") + i.name + f" [{i.unit}]" * bool(i.unit) for i in missing
    ]
    others = [*hints, *(c for c in columns if c not in hints)]
    what = "add it, or rename the column that holds it" + " in the header" * bool(record.place.line)
    if record.source and recording_of(Path(record.source)):
        what = "name the topics that hold it by --map FILE.toml"
    wanted = ", ".join(names)
    if len(wanted) > _NAMES:  # a message shortens what was wanted, not the remedy
        wanted, what = f"{len(names)} more inputs", f"{what}: {wanted}"
    if len(hints) == len(missing):
        what = "rename " + ", ".join(f"{old} to {name}" for old, name in hints.items())
    wanted = f"a column for {wanted}, of {estimator.name}"
    found = ", ".join(others[:12]) + ", ..." * (len(others) > 12)
    raise InputError.at(record.where, wanted=wanted, found=found, fix=what)


def _misspelt(estimator: Estimator, record: Record) -> Iterator[str]:
    """A line for each column without use whose name is nearly one that has a meaning."""
    known = {"t", "dt", "restart", "mov", *(o.name + TRUTH for o in estimator.outputs)}
    columns = {n for n in record.columns if n != "dt" or not record.place.by_time}
    columns |= {"t"} if _timed(record) else set()
    meant = {_letters(name): name for name in sorted(known - columns)}
    used = known | {i.name for i in estimator.inputs} | {o.name for o in estimator.outputs}
    for column in record.columns:
        name, unit = meant.get(_letters(column)), record.columns[column].unit
        if name is None or column in used:
            continue
        if name in ("t", "dt") and unit not in (None, *_TIME_UNITS):  # T[degC] is no time
            continue
        if name not in ("restart", "mov"):
            unit = "UNIT" if unit is None and re.search("[({]", column) else unit
            name = name if unit is None else f"{name}[{unit}]"
        yield f"column {column} is not used: rename it to {name}, if that is meant"


def _letters(name: str) -> str:
    """A name of a column without case, brackets, spaces and underscores; true for truth."""
    letters = re.sub(r"[\W_]", "", re.split(r"[(\[{]", name)[0].lower())
    return re.sub("truth$", "true", letters)


def _at_limits(declared: Input, record: Record, steps: FloatArray) -> FloatArray:
    """Differences of times, those at the limit that equal one within the times' own rounding."""
    if "dt" in record.columns and not record.place.by_time:
        return steps
    t = record.numbers("t")
    with np.errstate(over="ignore", invalid="ignore"):
        single = t.astype(np.float32)
        ulps = t / np.spacing(np.abs(single))  # an odd number of them somewhere: no digits beyond
    is_single = bool((single == t).all() and (ulps % 2.0 == 1.0).any())
    largest = float(np.abs(record.values("t", "s")).max())
    # Each time is rounded, and their difference; --every adds so many.
    rounding = 2.0 * selection().every * largest * np.finfo(np.float32 if is_single else float).eps
    if declared.unit not in ("", *EXACT_UNITS):
        rounding *= linear("s", declared.unit)[0]
    for limit in (declared.low, declared.high):
        steps = np.where(np.abs(steps - limit) <= rounding, limit, steps)
    return steps


def _truth(estimator: Estimator, record: Record) -> dict[str, FloatArray]:
    """True values of the outputs: columns ``NAME_true``, or NAME itself if it is not an input."""
    inputs, names = {i.name for i in estimator.inputs}, truth_names(record)
    truth = {
        o.name: record.values(names[o.name], o.unit)
        for o in estimator.outputs
        if o.name in names and names[o.name] not in inputs
    }
    if all(name in truth for name in QUATERNION):
        check_norm(record, np.stack([truth[name] for name in QUATERNION], axis=1))
    return truth
