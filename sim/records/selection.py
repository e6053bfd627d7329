"""Selected rows of a log file: slice of time, every n-th row, map of topics; gaps in the times.

`model.settings` holds the selection of all readers of log files.
"""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import require, require_choice, require_whole
from boresight.model.settings import CURRENT
from boresight.model.units import linear
from boresight.sim.records import record

#: Median steps from which on a step is a gap; an error, or a restart of an attitude filter.
GAP_STEPS, GAPS = 3.0, ("refuse", "restart")


@dataclass(frozen=True)
class Selection:
    """Rows of a log file that are read.

    ``start_s`` and ``end_s`` are times from the first row on: from (with it), to (without it). Of
    ``every`` rows the last is read; its time step is that of all of them, and a sample that only
    one of the others has stands in it. ``gaps`` is one of `GAPS`, or empty: a gap is one long step.
    ``map`` is a map of topics, instead of the ready ones.
    """

    start_s: float = 0.0
    end_s: float = math.inf
    every: int = 1
    gaps: str = ""
    map: Path | None = None

    @classmethod
    def of(
        cls,
        start: str | float | None = None,
        end: str | float | None = None,
        every: int | None = None,
        gaps: str | None = None,
        map: str | Path | None = None,
    ) -> Selection:
        """The selection of texts such as "10s"; raises InputError."""
        start_s, end_s = _seconds("--from", start, 0.0), _seconds("--to", end, math.inf)
        where, found = "--from" if end is None else "--to", f"{start_s:g} s and {end_s:g} s"
        wanted = "0 s or more for --from, and a later time for --to"
        require(0.0 <= start_s < end_s, where, wanted, found, "choose another")
        require_whole("--every", every, 1)
        if gaps is not None:
            fix = "choose one of these, or leave --gaps out: a gap is one long step then"
            require_choice("--gaps", gaps, GAPS, fix)
        return cls(start_s, end_s, every or 1, gaps or "", None if map is None else Path(map))

    @property
    def options(self) -> str:
        """Options of a command line that select these rows, each after a space."""
        return (
            f" --from {self.start_s!r}s" * (self.start_s > 0.0)
            + f" --to {self.end_s!r}s" * math.isfinite(self.end_s)
            + f" --every {self.every}" * (self.every > 1)
            + f" --gaps {self.gaps}" * bool(self.gaps)
            + f" --map {shlex.quote(str(self.map))}" * (self.map is not None)
        )

    @property
    def sliced(self) -> bool:
        """The rows begin or end within the log."""
        return self.start_s > 0.0 or math.isfinite(self.end_s)

    def pieces(self, blocks: Iterable[record.Record]) -> Iterator[record.Record]:
        """The selected rows of blocks that have their time steps and follow each other."""
        blocks, is_empty = iter(blocks), True
        first = next(blocks)
        rows: Iterator[record.Record] = chain([first], blocks)
        if self.sliced:
            rows = record.timed(self._slice(rows))
        if self.gaps:
            rows = _marked(rows, self.gaps)
        if self.every > 1:
            whole = record.resized(rows, -(-record.ROWS // self.every) * self.every)
            rows = (_thinned(block, self.every) for block in whole)
        for block in rows:
            if len(block):
                is_empty = False
                yield block
        wanted, few = f"rows in the slice, {self.every} or more", self.every > 1
        fix = "choose another slice" + ", or --every" * few
        require(not is_empty, first.where, wanted, "too few" if few else None, fix)

    def _slice(self, blocks: Iterable[record.Record]) -> Iterator[record.Record]:
        """The rows of the times that are selected, without steps: the first has none behind it."""
        first: float | None = None
        for block in blocks:
            wanted, fix = "a column t, of which a slice is taken", "add the times, or leave --from"
            require("t" in block.columns, block.where, wanted, None, f"{fix} and --to out")
            t = block.values("t", "s")
            first = float(t[0]) if first is None else first
            ends = np.array([first + self.start_s, first + self.end_s])
            low, high = np.searchsorted(t, ends - 2.0 * np.spacing(t[-1])).tolist()
            rows = record.rows_of(block, low, high)
            if block.place.by_time:
                rows = rows.derived({n: c for n, c in rows.columns.items() if n != "dt"})
            if len(rows):
                yield rows
            if high < len(block):
                break


def _thinned(log: record.Record, every: int) -> record.Record:
    """Every n-th row, with the sum of the time steps up to it."""
    end = len(log) - len(log) % every
    columns = {}
    for name, column in log.columns.items():
        values = column.values[:end].reshape(-1, every)
        if name == "dt":
            dt = values.sum(axis=1)
            thin = np.where((values < 0.0).any(axis=1), values.min(axis=1), dt)
        else:
            thin = values[:, -1].copy()
            for k in range(every - 2, -1, -1):  # the latest sample of a slower sensor
                thin = np.where(np.isnan(thin), values[:, k], thin)
        columns[name] = record.Column(thin, column.unit)
    return log.derived(columns, log.place.rows(every - 1, every))


def _marked(blocks: Iterable[record.Record], rule: str) -> Iterator[record.Record]:
    """Blocks with their gaps treated; the last has a note with their number."""
    limit = previous = None
    count, longest, pending = 0, 0.0, None
    for block in blocks:
        if pending is not None:
            yield pending
        wanted, fix = "a column t or dt, in which gaps are seen", "leave --gaps out"
        require(not {"t", "dt"}.isdisjoint(block.columns), block.where, wanted, None, fix)
        column = "t" if "t" in block.columns else "dt"
        if column == "t":
            t = block.values("t", "s")
            steps = np.diff(t, prepend=t[0] if previous is None else previous)
            previous = float(t[-1])
        else:
            steps = block.steps()
        if limit is None:
            inner = steps[steps > 0.0]
            limit = (
                GAP_STEPS * float(np.median(inner[: record.MEDIAN_OF])) if len(inner) else math.inf
            )
        gaps = steps > limit
        if gaps.any():
            row = int(np.argmax(gaps))
            wanted = f"steps of at most {limit:.6g} s, three medians"
            found = f"a gap of {steps[row]:.6g} s"
            fix = "without --gaps it is one step; --gaps restart restarts the filter"
            require(rule != "refuse", block.place(row, column), wanted, found, fix)
            count, longest = count + int(gaps.sum()), max(longest, float(steps.max()))
            dt = np.where(gaps, record.RESTART_S, block.steps())
            block = replace(block, columns={**block.columns, "dt": record.Column(dt, "s")})
        pending = block
    if pending is not None:
        text = "gaps in the times, where the filter restarts"
        notes = (f"{text}: {count}, the longest of {longest:.3g} s",) * (count > 0)
        yield replace(pending, notes=pending.notes + notes)


@dataclass(frozen=True)
class Clock:
    """Steps between the times of samples.

    ``rate_hz`` is that of the median step; ``jitter_s`` the root mean square of the steps' distance
    from it, without gaps, which are steps above `GAP_STEPS` medians. ``repeated`` counts messages
    with the time of another, ``late`` messages out of order.
    """

    samples: int
    rate_hz: float | None = None
    jitter_s: float = 0.0
    gaps: int = 0
    longest_s: float = 0.0
    repeated: int = 0
    late: int = 0

    @classmethod
    def of_steps(cls, steps: FloatArray) -> Clock:
        """The clock of steps between rising times [s]."""
        if not len(steps):
            return cls(1)
        median = float(np.median(steps))
        if median <= 0.0:  # times that are declared otherwise, such as restarts
            return cls(len(steps) + 1, longest_s=float(steps.max()))
        gaps = steps > GAP_STEPS * median
        jitter = float(np.sqrt(np.mean(np.square(steps[~gaps] - median))))
        return cls(len(steps) + 1, 1.0 / median, jitter, int(gaps.sum()), float(steps.max()))

    def extended(self, steps: FloatArray) -> Clock:
        """The clock with the gaps of further steps [s]."""
        limit = GAP_STEPS / self.rate_hz if self.rate_hz else math.inf
        gaps, longest = int((steps > limit).sum()), max(self.longest_s, float(steps.max()))
        samples = self.samples + len(steps)
        return replace(self, samples=samples, gaps=self.gaps + gaps, longest_s=longest)

    def notes(self, *, jitter: bool = True) -> list[str]:
        """A line for gaps and one for jitter, if there are any."""
        lines = [f"gaps in the times: {self.gaps}, longest {self.longest_s:.3g} s"]
        lines *= self.gaps > 0
        if jitter and self.rate_hz and self.jitter_s * self.rate_hz > 0.1:
            lines.append(
                f"steps of {1e3 / self.rate_hz:.3g} ms differ by {1e3 * self.jitter_s:.3g} ms (rms)"
            )
        return lines


_TIME = re.compile(r"([-+0-9.eE]+)\s*([A-Za-z]*)")


def _seconds(where: str, value: str | float | None, default: float) -> float:
    """A time such as 10s, 500ms, 2min; a plain number is in seconds."""
    if value is None:
        return default
    seconds = math.inf
    if match := _TIME.fullmatch(str(value).strip()):
        with suppress(ValueError):
            seconds = float(match[1]) * linear(match[2] or "s", "s")[0]
    require(math.isfinite(seconds), where, "a time such as 10s or 2min", value)
    return seconds


def selection() -> Selection:
    """The selection of `model.settings`."""
    return CURRENT.get().rows or Selection()
