"""Results of the simulated board: the run of each filter and the trial of each fault."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from boresight.sim.answer import Answer, JsonObject, plain
from boresight.sim.attitude.board.faults import FaultTrial
from boresight.sim.attitude.board.setup import Setup
from boresight.sim.attitude.board.timeline import Timeline

__all__ = ["BoardFigures", "BoardResult", "FaultsResult", "fault_line", "runs_table"]


@dataclass(frozen=True)
class BoardFigures:
    """Metrics of one filter's run on the board.

    Attributes
    ----------
    filter : str
    updates, frames : int
        Updates of the filter, and frames to the host; equal in a good run.
    mismatches, first_mismatch
        Frames that differ from the integer models, and the first of them (empty: none).
    lost_samples : int
        Samples without an update.
    fields, compass_lines : int
        Updates with a fresh field; good lines of the compass.
    transfer_cycles, core_cycles : (int, int)
        Least and most clock cycles of the reader and of the core.
    program_cycles : int
        Cycles of the schedules of the chain.
    beside_program_us, in_registers_us, predicted_us, frame_end_us : float
        Most time of the core beside its programs; from data ready to the registers, as counted and
        as predicted; to the last bit of the frame.
    timing_violations, damaged_frames : int
        Violations of the devices' timing; frames whose check failed.
    cycles, cycles_per_s : int
        Simulated cycles, and the simulator's rate.
    good : bool
        Whether nothing was lost, differs or is damaged.
    """

    filter: str
    updates: int
    frames: int
    mismatches: int
    first_mismatch: str
    lost_samples: int
    fields: int
    compass_lines: int
    transfer_cycles: tuple[int, int]
    core_cycles: tuple[int, int]
    program_cycles: int
    beside_program_us: float
    in_registers_us: float
    predicted_us: float
    frame_end_us: float
    timing_violations: int
    damaged_frames: int
    cycles: int
    cycles_per_s: int
    good: bool


@dataclass(frozen=True)
class BoardResult(Answer):
    """Result of `boresight.simulate`, stored in ``board.json``.

    Attributes
    ----------
    config, source, log : str
        Configuration of the core, output of the compass, name of the motion.
    clock_mhz : float
        The system's clock.
    good : bool
        Whether all runs are good.
    runs : tuple of BoardFigures
        Metrics of each filter.
    timelines : tuple of Timeline
        One update of each filter.
    setup : Setup
        Parameters of the system.
    build : str
        Number of the build, hexadecimal.
    """

    config: str
    source: str
    log: str
    clock_mhz: float
    good: bool
    runs: tuple[BoardFigures, ...]
    timelines: tuple[Timeline, ...]
    setup: Setup
    build: str

    def __str__(self) -> str:
        return runs_table(self.runs)


def runs_table(runs: tuple[BoardFigures, ...]) -> str:
    """Metrics of runs as a table of text."""
    lines = [
        f"{'filter':16s}{'updates':>9s}{'lost':>6s}{'differ':>8s}{'fields':>8s}"
        f"{'in registers':>14s}{'beside program':>16s}{'last bit':>10s}{'cycles/s':>12s}"
    ]
    for r in runs:
        lines.append(
            f"{r.filter:16s}{r.updates:>9,d}{r.lost_samples:>6d}{r.mismatches:>8d}"
            f"{r.fields:>8d}{r.in_registers_us:>11.2f} us{r.beside_program_us:>13.2f} us"
            f"{r.frame_end_us:>7.0f} us{r.cycles_per_s:>12,d}"
        )
        if r.first_mismatch:
            lines.append(f"  first difference: {r.first_mismatch}")
    return "\n".join(lines)


@dataclass(frozen=True)
class FaultsResult(Answer):
    """Result of `boresight.simulate_faults`.

    Attributes
    ----------
    filter : str
        Filter that ran.
    trials : tuple of FaultTrial
        Result of each fault.
    """

    filter: str
    trials: tuple[FaultTrial, ...]

    @property
    def good(self) -> bool:
        """Whether all trials are good."""
        return all(t.good for t in self.trials)

    def to_json(self) -> JsonObject:
        """Plain data, with ``good``."""
        rows: Any = [{**_object(t), "good": t.good} for t in self.trials]
        return {"filter": self.filter, "good": self.good, "trials": rows}

    def __str__(self) -> str:
        head = (
            f"{'fault':24s}{'lasts':>8s}{'seen after':>12s}{'dropped':>9s}{'back after':>12s}"
            f"{'error before':>14s}{'during':>8s}{'after':>8s}  seen as"
        )
        return "\n".join([head, *map(fault_line, self.trials)])


def _object(trial: FaultTrial) -> JsonObject:
    """Fields of a trial."""
    data = plain(trial)
    assert isinstance(data, dict)
    return data


def fault_line(t: FaultTrial) -> str:
    """Row of the table of a trial."""

    def s(value: float | None) -> str:
        return "never" if value is None else f"{value:.4f} s"

    return (
        f"{t.device + ' ' + t.fault:24s}{t.fault_s:>6.2f} s{s(t.seen_after_s):>12s}"
        f"{t.dropped:>9d}{s(t.back_after_s):>12s}{t.before_deg:>10.2f} deg"
        f"{t.during_deg:>8.2f}{t.after_deg:>8.2f}  {', '.join(t.seen_as[:3])}"
        + ("" if t.good else "  FAILED")
        + ("" if t.seen_as or not t.good else "no effect")
    )
