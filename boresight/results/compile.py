"""What `boresight compile` made: latencies, area, clock."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from boresight.depths import DepthChoice
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.sim.answer import Answer, Figure, JsonObject, plain
from boresight.sim.report.against import JUDGED

__all__ = ["CompileResult", "CompiledProgram", "Proven", "TargetFigures"]


@dataclass(frozen=True)
class Proven:
    """Proof that what was compiled computes the programs, for all inputs (docs/proofs.md).

    Attributes
    ----------
    operations : int
        Operations of all programs.
    firmware : bool
        Whether the C is proven, too.
    seconds : float
        Time of the proof.
    """

    operations: int
    firmware: bool
    seconds: float

    def __str__(self) -> str:
        what = "microcode and C" if self.firmware else "microcode"
        return f"{self.operations} operations, {what}, all inputs  {self.seconds:.1f} s"


#: Clock for which times are given.
_CLOCK_HZ = 100e6


@dataclass(frozen=True)
class TargetFigures:
    """What a design takes on a target, and its clock after routing.

    Attributes
    ----------
    target : str
    used : mapping of str to float
        Cells by resource: lut, ff, dsp, and the block RAM.
    clock_mhz : float or None
        Of the worst seed; None: not routed.
    estimate_mhz : mapping of str to float, optional
        Estimate of the clock with ``median`` and ``p75`` (upper quartile) delays of nets.
    seeds : mapping of int to float
        Clock of each seed, MHz.
    text : str
        All of it, with the tools.
    """

    target: str
    used: Mapping[str, float]
    clock_mhz: float | None
    seeds: Mapping[int, float | None]
    text: str
    estimate_mhz: Mapping[str, float] | None = None

    @classmethod
    def of(cls, made: Mapped | Routed) -> TargetFigures:
        """Those of a design."""
        mapped = made.mapped if isinstance(made, Routed) else made
        runs = made.runs if isinstance(made, Routed) else ()
        clock = made.clock_mhz if isinstance(made, Routed) else None
        timed = isinstance(made, Routed) and not made.untimed
        seeds = {run.seed: run.clock_mhz if timed else None for run in runs}
        estimate = None if made is not mapped or mapped.clock is None else mapped.clock.by_nets
        return cls(mapped.target.name, mapped.used, clock, seeds, str(made), estimate)


@dataclass(frozen=True)
class CompiledProgram:
    """One estimator in a core: when its outputs come.

    Attributes
    ----------
    name : str
    latency_cycles : mapping of str to int
        From the last input word to each output.
    interval_cycles : int
        From one record to the next.
    profile : str
        The profile of `boresight fit` that chose formats, or empty.
    """

    name: str
    latency_cycles: Mapping[str, int]
    interval_cycles: int
    profile: str = ""


@dataclass(frozen=True)
class CompileResult(Answer):
    """What `compile` gives.

    Attributes
    ----------
    output : Path
        Folder of the files.
    config : str
        Configuration of the core.
    word : int
        Word width, bits.
    digest : str
        Of the microcode and the schedule: the same digest, the same bits.
    programs : tuple of CompiledProgram
        The estimators, by their numbers in the core.
    proven : Proven
        What was proven of the core before its files were written.
    core : TargetFigures or None
        Area and clock of the core, with ``synth`` or ``route``.
    system : TargetFigures or None
        Those of the complete system, or of the design that was routed on a board.
    rate_hz : float or None
        Records a second that are planned.
    clock_mhz : float or None
        Clock that is asked for.
    depth : DepthChoice or None
        Depth of the pipeline, if it was chosen by time.
    report : mapping
        Contents of report.json, and of `to_json`; with several estimators, what concerns them all
        and under ``programs`` the report of each.
    """

    judged: ClassVar[Mapping[str, Figure]] = JUDGED

    output: Path
    config: str
    word: int
    digest: str
    programs: tuple[CompiledProgram, ...]
    proven: Proven
    core: TargetFigures | None
    system: TargetFigures | None
    report: JsonObject = field(repr=False)
    rate_hz: float | None = None
    clock_mhz: float | None = None
    depth: DepthChoice | None = None

    @property
    def good(self) -> bool:
        """The core is done with every record in time, and reaches the clock asked for."""
        return not self._slow and all(self._busy(p) <= 1.0 for p in self.programs)

    @property
    def _routed_mhz(self) -> float | None:
        return None if self.core is None else self.core.clock_mhz

    @property
    def _slow(self) -> bool:
        """The clock that is asked for is not reached."""
        return (self._routed_mhz or math.inf) < (self.clock_mhz or 0.0)

    @property
    def _clock_hz(self) -> float:
        """Clock for which times are given: asked for, or as routed, or 100 MHz."""
        mhz = self.clock_mhz or self._routed_mhz
        return _CLOCK_HZ if mhz is None else 1e6 * mhz

    def _busy(self, program: CompiledProgram) -> float:
        """Share of the time that a program needs at the planned rate."""
        return (self.rate_hz or 0.0) * program.interval_cycles / self._clock_hz

    def _percent(self, program: CompiledProgram) -> str:
        """The busy share, without an exponent."""
        percent = 100.0 * self._busy(program)
        return f"{percent:.2g} %" if percent < 99.5 else f"{percent:,.0f} %"

    def _failed(self) -> str:
        """Last line of a core that does not do what was asked for."""
        what = [
            f"{p.name} is busy {self._percent(p)} at {_plain(self.rate_hz or 0.0)} Hz"
            for p in self.programs
            if self._busy(p) > 1.0
        ]
        if self._slow:
            what.append(f"clock {self._routed_mhz} MHz, below {self.clock_mhz:g} MHz")
        return f"FAILED: {'; '.join(what)}"

    def _interval(self, program: CompiledProgram) -> str:
        """The interval, and what it means."""
        most = self._clock_hz / program.interval_cycles
        mhz = f"{self._clock_hz / 1e6:g} MHz"
        text = f"interval {program.interval_cycles}, at {mhz} up to {most:,.0f} updates/s"
        if self.rate_hz is None:
            return text
        busy = f"{self._percent(program)} at {_plain(self.rate_hz)} Hz"
        return f"{text}; busy {busy}{', TOO SLOW' * (self._busy(program) > 1.0)}"

    def to_json(self) -> JsonObject:
        """The contents of report.json."""
        return self.report

    def _shown(self) -> JsonObject:
        rows: list[JsonObject] = [
            {"program": p.name, "output": name, "latency_cycles": latency}
            for p in self.programs
            for name, latency in p.latency_cycles.items()
        ]
        figures = {"core": self.core, "system": self.system}
        return {
            "output": str(self.output),
            "config": self.config,
            "word": self.word,
            "programs": plain(rows),
            "area and clock": plain({k: v for k, v in figures.items() if v is not None}),
        }

    def __str__(self) -> str:
        lines = [
            f"{self.output}: {p.name + ': ' if len(self.programs) > 1 else ''}"
            + ", ".join(f"{k} {v}" for k, v in p.latency_cycles.items())
            + f" cycles; {self._interval(p)}"
            for p in self.programs
        ]
        lines += [p.profile for p in self.programs if p.profile]
        if self.depth is not None:
            lines.append(str(self.depth))
        lines.append(f"proven: {self.proven}")
        for name, design in (("core", self.core), ("on the board", self.system)):
            if design is not None:
                slow = design is self.core and self._slow
                missed = f"; BELOW {self.clock_mhz:g} MHz" if slow else ""
                lines.append(f"{name}: {design.text}{missed}")
        return "\n".join(lines if self.good else [*lines, self._failed()])


def _plain(rate: float) -> str:
    """A rate without an exponent, whole ones in groups of three digits."""
    return f"{rate:,.0f}" if rate >= 1000.0 and rate == round(rate) else f"{rate:g}"
