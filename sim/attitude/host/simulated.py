"""Results of the simulated board: the run of each filter and the trial of each fault."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from boresight.sim.attitude.board.faults import FaultTrial
from boresight.sim.result import Result

__all__ = ["BoardFigures", "board_result", "fault_line", "faults_result"]


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


def board_result(
    data: Mapping[str, Any], runs: Sequence[BoardFigures], notes: Sequence[str] = ()
) -> Result:
    """Result of a simulation of the board: its data and a row for each filter."""
    rows = [
        {
            "filter": r.filter,
            "updates": r.updates,
            "lost": r.lost_samples,
            "differ": r.mismatches,
            "fields": r.fields,
            "in registers, us": r.in_registers_us,
            "beside program, us": r.beside_program_us,
            "last bit, us": r.frame_end_us,
            "cycles/s": r.cycles_per_s,
        }
        for r in runs
    ]
    failures = [f"{r.filter}: {r.first_mismatch or 'samples lost'}" for r in runs if not r.good]
    return Result({**data, "runs": runs}, {"filters": rows}, notes=notes, failures=failures)


def faults_result(filter: str, trials: Sequence[FaultTrial]) -> Result:
    """Result of all trials of faults."""
    rows: list[Any] = [{**vars(trial), "good": trial.good} for trial in trials]
    head = (
        f"{'fault':24s}{'lasts':>8s}{'seen after':>12s}{'dropped':>9s}{'back after':>12s}"
        f"{'error before':>14s}{'during':>8s}{'after':>8s}  seen as"
    )
    return Result(
        {"filter": filter, "trials": rows},
        summary="\n".join([head, *map(fault_line, trials)]),
        failures=[f"{t.device} {t.fault}" for t in trials if not t.good],
    )


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
