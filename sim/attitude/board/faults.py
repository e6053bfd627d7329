"""Every fault of both devices on the complete board: detection, effect and recovery.

All parts of the board run 16 times as fast as the real one, and the parameter ``tick_s`` is scaled,
so that the filter sees real times and rates. All times here are those of the real board.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from boresight.gateware.attitude.system.interface import WORDS
from boresight.model.arrays import FloatArray, IntArray
from boresight.model.attitude.front import GYRO_COUNTS, GYRO_SCALE
from boresight.model.declarations import GRAVITY
from boresight.sim.attitude.board.build import FASTER, FAULTY, Board, make_board
from boresight.sim.attitude.board.run import BoardRun, run_board, stimulus
from boresight.sim.attitude.devices import COMPASS_FAULTS, INERTIAL_FAULTS
from boresight.sim.attitude.worlds import RAMP_S, fast_turn, synthetic_log, white
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.accuracy import attitude_error
from boresight.sim.rtl.simulators import SimulationFailed

#: First and last sample of an inertial fault; of a compass fault its lines.
_INERTIAL_SPAN, _COMPASS_SPAN = (1200, 1400), (9, 15)
#: Largest accepted error during a fault, and a second after it, degrees; of a fast turn, where the
#: gyro misses 2.7 deg and the compass tells of the past.
_BOUNDS_DEG, _FAST_TURN_BOUNDS_DEG = (5.0, 1.0), (12.0, 3.0)
#: Rate of a fast turn in full scales of the gyro, for how long it is at full scale [s], and how
#: long it takes with rise and fall.
_BEYOND, _FULL_SCALE_S = 1.1, 0.1
_TURN_S = _FULL_SCALE_S + 2.0 * RAMP_S / _BEYOND
#: Updates of a run, and samples more in the log, for those that a fault costs.
_UPDATES, _SPARE = 3200, 400
_MAX_CYCLES = 60_000_000
#: Factor by which the motion is slower than that of `synthetic_log`.
_SLOWER = 6.0
#: Events of the sensors that do not indicate a fault.
_NORMAL = ("inertial_sample", "compass_heading_line")


def _stuck(log: NineAxis, first: int, last: int) -> NineAxis:
    acc = log.acc.copy()
    acc[first:last] = acc[first]
    return replace(log, acc=acc)


def _saturated(log: NineAxis, first: int, last: int) -> NineAxis:
    acc = log.acc.copy()
    acc[first:last, 0] = 5.0 * GRAVITY  # full scale of the ADIS16385
    return replace(log, acc=acc)


def _fast_turn(axis: int) -> Callable[[NineAxis, int, int], NineAxis]:
    """The sensor really turns beyond its gyro's full scale, from the first row on."""
    rate = _BEYOND * GYRO_COUNTS * GYRO_SCALE * np.eye(3)[axis]

    def turned(log: NineAxis, first: int, last: int) -> NineAxis:
        seconds, begin_s = _TURN_S - 2.0 * RAMP_S, float(log.t[first])
        return fast_turn(log, begin_s=begin_s, rate_rad_s=rate, seconds=seconds)

    return turned


#: Values in valid form that the filter must survive: each puts wrong forces into some rows of a
#: log, or turns it and its truth too fast.
WRONG_VALUES: dict[str, Callable[[NineAxis, int, int], NineAxis]] = {
    "force_stuck": _stuck,
    "force_saturated": _saturated,
    **{f"fast_turn_{name}": _fast_turn(axis) for axis, name in enumerate("xyz")},
}
#: All faults.
FAULTS = (
    *(f"adis.{fault}" for fault in (*INERTIAL_FAULTS, *WRONG_VALUES)),
    *(f"hmr.{fault}" for fault in COMPASS_FAULTS),
)


def trial_log() -> NineAxis:
    """The motion of the trials, slow turns, with ordinary sensor errors and exact truth."""
    # Made at a higher rate than that of playback, which slows all motion.
    log = NineAxis.of(
        synthetic_log(
            seconds=(_UPDATES + _SPARE + 600) / 1024 / _SLOWER,
            rate_hz=1024.0 * _SLOWER,
            seed=5,
            acceleration=0.1,
            gyr_error=white(noise=0.003 * _SLOWER),
            acc_error=white(noise=0.05),
            name="fault trials",
        )
    )
    return replace(log, t=log.t * _SLOWER, gyr=log.gyr / _SLOWER, steps=None)


def fault_board(name: str) -> Board:
    """Return a board with one filter, 16 times as fast as the real one."""
    tick = {"calibrate_inertial": {"tick_s": FASTER / FAULTY.clock_hz}}
    return make_board(FAULTY, filters=[name], params=tick)


def fault_trial(board: Board, fault: str, log: NineAxis) -> dict[str, Any]:
    """Run one of `FAULTS`, and judge it.

    ``seen_after_s`` is the time from its begin to the first event that indicates it (None: never),
    with these events ``seen_as``; ``back_after_s`` that from its end to the next update (inertial)
    or good line (compass); samples are ``dropped`` between begin and recovery. The largest errors
    of the attitude are those in the half second ``before_deg``, ``during_deg`` the fault (with the
    first half second after it), and in the last half second of the run. It is ``good`` if it was
    detected or had no effect, and the error stayed and ended within bounds.
    """
    device, name = fault.split(".")
    first, last = _INERTIAL_SPAN if device == "adis" else _COMPASS_SPAN
    texts = {}
    if name in WRONG_VALUES:
        last = first + round(1024 * _TURN_S) if name.startswith("fast_turn") else last
        log = WRONG_VALUES[name](log, first, last)
    else:
        bit = (INERTIAL_FAULTS if device == "adis" else COMPASS_FAULTS).index(name)
        texts[device] = f"{first} {last} {bit}\n"
    run = run_board(
        board,
        stimulus(log.record(), board),
        updates=_UPDATES,
        settings={"output_divider": 1},
        faults=texts,
        max_cycles=_MAX_CYCLES,
    )
    if name in WRONG_VALUES:  # cycles of the rows of the log
        ready = run.trace.ready
        begin, end = (float(ready[np.searchsorted(ready[:, 1], k + 1), 0]) for k in (first, last))
    else:
        on = [(cycle, adis | hmr) for cycle, adis, hmr in run.trace.faults]
        begin = next((float(cycle) for cycle, bits in on if bits), np.inf)
        end = next((float(cycle) for cycle, bits in on if cycle > begin and not bits), 0.0)
        if not end:
            raise SimulationFailed(f"the fault {fault} did not begin and end within the run")
    row = {"fault": fault, **_effect(board, run, log, device, begin, end)}
    return row | {"good": is_good(row)}


def is_good(row: dict[str, Any]) -> bool:
    """The fault was detected, or had no effect; and the error stayed and ended within bounds."""
    most, later = _FAST_TURN_BOUNDS_DEG if "fast_turn" in row["fault"] else _BOUNDS_DEG
    harmless = row["dropped"] == 0 and row["during_deg"] <= max(1.0, 1.2 * row["before_deg"])
    # Values that stay are legal: no reader can tell them from right ones.
    detected = row["seen_after_s"] is not None or row["fault"] == "adis.force_stuck"
    back = row["back_after_s"] is not None
    return bool(
        (detected or harmless) and back and row["during_deg"] <= most and row["after_deg"] <= later
    )


def _errors(run: BoardRun, log: NineAxis) -> tuple[IntArray, FloatArray]:
    """Cycle of each update with a frame, and the angle between its attitude and the truth, deg."""
    trace = run.trace
    number = np.unwrap(run.frames[:, 0] & 0xFFFF, period=1 << 16).astype(np.int64)
    valid = (number >= 1) & (number <= len(trace.updates))
    updated = trace.updates[number[valid] - 1]
    line = trace.ready[np.searchsorted(trace.ready[:, 0], updated) - 1, 1]
    q = run.frames[valid, WORDS.index("qw") : WORDS.index("qz") + 1].astype(np.float64)
    return updated, attitude_error(q, log.attitude[np.minimum(line - 1, len(log) - 1)]).total


def _effect(
    board: Board, run: BoardRun, log: NineAxis, device: str, begin: float, end: float
) -> dict[str, Any]:
    """The figures of `fault_trial`, of a fault between two cycles."""
    trace, second = run.trace, board.setup.clock_hz / FASTER  # of the real board, in cycles
    cycles, errors = _errors(run, log)
    until = float(cycles[-1] + 1)
    prefix, good_cycles = "inertial_", trace.updates
    if device == "hmr":
        prefix, good_cycles = "compass_", np.array([x.cycle for x in trace.lines])
    signs = {1 << k: n for k, n in enumerate(board.system.events) if n.startswith(prefix)}
    delays: dict[str, float] = {}
    for cycle, bits in trace.events:
        for mask, name in signs.items():
            if bits & mask and begin <= cycle < until and name not in _NORMAL:
                delays.setdefault(name, (cycle - begin) / second)
    recoveries = good_cycles[good_cycles > end]
    recovery = float(recoveries[0]) if len(recoveries) else float(trace.updates[-1])
    expected = (min(recovery, float(trace.updates[-1])) - begin) / board.setup.period_cycles
    updated = int(((trace.updates > begin) & (trace.updates < recovery)).sum())
    half = 0.5 * second
    spans = {
        "before_deg": (begin - half, begin),
        "during_deg": (begin, end + half),
        "after_deg": (until - half, until),
    }
    worst = {
        key: float(errors[(cycles >= since) & (cycles < to)].max(initial=0.0))
        for key, (since, to) in spans.items()
    }
    return {
        "seen_after_s": min(delays.values(), default=None),
        "back_after_s": (recovery - end) / second if len(recoveries) else None,
        "dropped": max(int(expected) - updated, 0),
        **worst,
        "seen_as": ", ".join(delays),
    }
