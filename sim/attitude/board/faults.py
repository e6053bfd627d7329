"""Every fault of both devices on the complete board: detection, effect and recovery.

All parts of the board run 16 times as fast as the real one, and the parameter ``tick_s`` is scaled,
so that the filter sees real times and rates. All times here are those of the real board.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from boresight.gateware.attitude.system.attitude_frame import WORDS
from boresight.model.arrays import FloatArray, IntArray
from boresight.model.resolve import Named
from boresight.sim.attitude.board.build import Board, make_board
from boresight.sim.attitude.board.run import BoardRun, run_board, stimulus
from boresight.sim.attitude.board.setup import FASTER, FAULTY
from boresight.sim.attitude.board.wrong_values import FAST_TURNS, TURN_S, WRONG_VALUES, wronged
from boresight.sim.attitude.devices import COMPASS_FAULTS, INERTIAL_FAULTS
from boresight.sim.attitude.worlds.synthetic import SensorError, synthetic_log
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.result import Result
from boresight.sim.rotations.rotation import quaternion_conjugate, quaternion_multiply
from boresight.sim.rtl.simulators import SimulationFailed

#: First and last sample of an inertial fault and of a fast turn; of a compass fault its lines.
_INERTIAL_SPAN, _COMPASS_SPAN = (1200, 1400), (9, 15)
_FAST_TURN_SPAN = (1200, 1200 + round(1024 * TURN_S))
#: Largest accepted error during a fault, and a second after it, degrees.
BOUNDS_DEG = (5.0, 1.0)
#: Of a fast turn: the gyro misses 2.7 deg, and the compass tells of the past (docs/system.md).
FAST_TURN_BOUNDS_DEG = (12.0, 3.0)
#: Updates of a run, and samples more in the log, for those that a fault costs.
_UPDATES, _SPARE = 3200, 400
_MAX_CYCLES = 60_000_000
#: Factor by which the motion is slower than that of `synthetic_log`.
_SLOWER = 6.0
#: Events that do not indicate a fault.
_NORMAL = {
    "inertial_sample",
    "compass_heading_line",
    "core_update",
    "core_field_used",
    "output_attitude_sent",
    "host_bad_address",
}


@dataclass(frozen=True)
class FaultTrial:
    """Result of a fault. Times in s of the real board, angles in degrees.

    Attributes
    ----------
    device, fault : str
        Device and name of the fault.
    fault_s : float
        Duration of the fault.
    seen_after_s : float or None
        From its begin to the first event that indicates it; None: never.
    seen_as : tuple of str
        Events, in the order of their first occurrence.
    dropped : int
        Samples without an update between begin and recovery.
    before_deg, during_deg, after_deg : float
        Largest error of the attitude in the half second before, during the fault (with the first
        half second after it), and in the last half second of the run, or before the next fault.
    back_after_s : float or None
        From its end to the first update (inertial) or good line (compass); None: never.
    """

    device: str
    fault: str
    fault_s: float
    seen_after_s: float | None
    seen_as: tuple[str, ...]
    dropped: int
    before_deg: float
    during_deg: float
    after_deg: float
    back_after_s: float | None

    @property
    def harmless(self) -> bool:
        """Whether the fault had no effect: no sample dropped, no event, no larger error."""
        return (
            self.seen_after_s is None
            and self.dropped == 0
            and self.during_deg <= max(1.0, 1.2 * self.before_deg)
        )

    @property
    def good(self) -> bool:
        """The fault was detected, or had no effect; and the error stayed and ended within bounds.

        Faults that no reader can detect need not be detected.
        """
        largest, later = FAST_TURN_BOUNDS_DEG if self.fault in FAST_TURNS else BOUNDS_DEG
        return (
            (self.seen_after_s is not None or self.harmless or self.unseen)
            and self.back_after_s is not None
            and self.during_deg <= largest
            and self.after_deg <= later
        )

    @property
    def unseen(self) -> bool:
        """Whether the fault gives values that no reader can tell from right ones."""
        return self.fault == "force_stuck"


def fault_names() -> list[str]:
    """All faults, as ``adis.absent``."""
    faults_of = {"adis": (*INERTIAL_FAULTS, *WRONG_VALUES), "hmr": COMPASS_FAULTS}
    return [f"{device}.{fault}" for device, faults in faults_of.items() for fault in faults]


def trial_log() -> Record:
    """The motion of the trials, slow turns, with ordinary sensor errors and exact truth."""
    # Made at a higher rate than that of playback, which slows all motion.
    log = NineAxis.of(
        synthetic_log(
            seconds=(_UPDATES + _SPARE + 600) / 1024 / _SLOWER,
            rate_hz=1024.0 * _SLOWER,
            seed=5,
            acceleration=0.1,
            gyr_error=SensorError(noise=0.003 * _SLOWER),
            acc_error=SensorError(noise=0.05),
            name="fault trials",
        )
    )
    slow = replace(log, t=log.t * _SLOWER, gyr=log.gyr / _SLOWER, steps=None)
    return slow.record()


def fault_board(filters: Sequence[Named] = ("mekf",)) -> Board:
    """Return a board 16 times as fast as the real one, by default with one filter."""
    return make_board(
        FAULTY, filters=filters, params={"calibrate_inertial": {"tick_s": FASTER / FAULTY.clock_hz}}
    )


def fault_trial(board: Board, device: str, fault: str, *, log: Record | None = None) -> FaultTrial:
    """Run one fault: an inertial one is over after 1,400 samples, one of the compass after 1,900.

    Parameters
    ----------
    device : str
        "adis" or "hmr".
    fault : str
        One of `INERTIAL_FAULTS`, `COMPASS_FAULTS`, `WRONG_VALUES`.

    Raises
    ------
    SimulationFailed
        The fault did not begin or did not end within the run.
    """
    default = _COMPASS_SPAN if device == "hmr" else _INERTIAL_SPAN
    first, last = _FAST_TURN_SPAN if fault in FAST_TURNS else default
    log = log or trial_log()
    texts = {}
    if fault in WRONG_VALUES:
        log = wronged(log, fault, slice(first, last))
    else:
        bit = (INERTIAL_FAULTS if device == "adis" else COMPASS_FAULTS).index(fault)
        texts[device] = f"{first} {last} {bit}\n"
    run = run_board(
        board,
        stimulus(log, board),
        updates=_UPDATES,
        settings={"output_divider": 1},
        faults=texts,
        max_cycles=_MAX_CYCLES,
    )
    if fault in WRONG_VALUES:  # cycles of the rows of the log
        ready = run.trace.ready
        span = [float(ready[np.searchsorted(ready[:, 1], k + 1), 0]) for k in (first, last)]
    else:
        on = [(cycle, (adis if device == "adis" else hmr)) for cycle, adis, hmr in run.trace.faults]
        begin = next((float(cycle) for cycle, bits in on if bits), np.inf)
        span = [begin, next((float(cycle) for cycle, bits in on if cycle > begin and not bits), -1)]
        if span[1] < 0:
            raise SimulationFailed(f"the fault of {device} did not begin and end within the run")
    return _judge(board, run, log, device, fault, (span[0], span[1]))


def _errors(run: BoardRun, log: Record) -> tuple[IntArray, FloatArray]:
    """Cycle of each update with a frame, and the angle between its attitude and the truth, deg."""
    trace = run.trace
    q_true = NineAxis.of(log).attitude
    number = np.unwrap(run.frames[:, 0] & 0xFFFF, period=1 << 16).astype(np.int64)
    valid = (number >= 1) & (number <= len(trace.updates))
    number, frames = number[valid], run.frames[valid]
    updated = trace.updates[number - 1]
    line = trace.ready[np.searchsorted(trace.ready[:, 0], updated) - 1, 1]
    truth = q_true[np.minimum(line - 1, len(log) - 1)]
    q = frames[:, WORDS.index("qw") : WORDS.index("qz") + 1].astype(np.float64)
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    error = quaternion_multiply(q, quaternion_conjugate(truth))
    return updated, np.degrees(2.0 * np.arccos(np.clip(np.abs(error[:, 0]), 0.0, 1.0)))


def _judge(
    board: Board, run: BoardRun, log: Record, device: str, fault: str, span: tuple[float, float]
) -> FaultTrial:
    trace, names = run.trace, board.system.events
    second = board.setup.clock_hz / FASTER  # of the real board, in cycles
    begin, end = span
    cycles, errors = _errors(run, log)
    until = float(cycles[-1] + 1 if len(cycles) else end)
    delays: dict[str, float] = {}
    prefix = ("inertial_",) if device == "adis" else ("compass_",)
    for cycle, bits in trace.events:
        for k, name in enumerate(names):
            is_sign = name.startswith(prefix) and name not in _NORMAL
            if bits >> k & 1 and begin <= cycle < until and is_sign:
                delays.setdefault(name, (cycle - begin) / second)
    good_cycles = trace.updates if device == "adis" else np.array([x.cycle for x in trace.lines])
    recoveries = good_cycles[good_cycles > end]
    recovery = float(recoveries[0]) if len(recoveries) else float(trace.updates[-1])
    expected = (min(recovery, float(trace.updates[-1])) - begin) / board.setup.period_cycles
    update_count = int(((trace.updates > begin) & (trace.updates < recovery)).sum())

    def worst(since: float, until: float) -> float:
        part = errors[(cycles >= since) & (cycles < until)]
        return float(part.max()) if len(part) else 0.0

    half = 0.5 * second
    return FaultTrial(
        device,
        fault,
        (end - begin) / second,
        min(delays.values(), default=None),
        tuple(sorted(delays, key=lambda name: delays[name])),
        max(int(expected) - update_count, 0),
        worst(begin - half, begin),
        worst(begin, end + half),
        worst(until - half, until),
        (recovery - end) / second if len(recoveries) else None,
    )


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
