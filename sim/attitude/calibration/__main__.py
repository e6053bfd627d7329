"""``python -m boresight.sim.attitude.calibration``: calibrate simulated devices.

Is every register recovered within its uncertainty, and what does the attitude gain?
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.attitude.front import FRONT
from boresight.model.attitude.front.affine import AXES
from boresight.model.attitude.mekf import Mekf
from boresight.model.errors import InputError, ToolMissing, require
from boresight.sim.accuracy.figures import attitude_errors
from boresight.sim.attitude.calibration.files import calibrated
from boresight.sim.attitude.calibration.world import FIELD_UT, Device, calibration_records, device
from boresight.sim.attitude.worlds.synthetic import synthetic_log
from boresight.sim.experiments.forms import run_forms
from boresight.sim.plotting import COLOUR, INK, figure_and_axes, legend, log_axis, settings
from boresight.sim.records.feed import feed
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.outputs import attitude_of

#: Uncertainties within which all registers of a device shall be, and the share of devices.
_SIGMAS, _SHARE = 3.0, 0.95
#: s, of a flight; of its beginning, which is not judged.
_FLIGHT_S, _ALIGNED_S = 60.0, 20.0
#: Standard deviation of a sight about each axis, simulated and stated [deg].
_SIGHT_DEG = 0.05


class Trial(NamedTuple):
    """A device, calibrated from its records.

    ``errors`` of each register, in its stated uncertainty; ``attitude`` holds the rms error of an
    attitude [deg] with the registers as declared, as found and as they are.
    """

    errors: dict[str, float]
    attitude: dict[str, float]

    def __str__(self) -> str:
        name, error = max(self.errors.items(), key=lambda item: abs(item[1]))
        angles = ", ".join(f"{kind} {value:.3f}" for kind, value in self.attitude.items())
        return f"worst register {name} {error:+.2f} uncertainties; attitude, deg: {angles}"


def trial(seed: int, **size: Any) -> Trial:
    """Calibrate the device of a seed, and fly with it; ``size`` is of `calibration_records`."""
    drawn = device(seed)
    records = calibration_records(drawn, seed, sight_deg=_SIGHT_DEG, **size)
    found = calibrated(*records, field_ut=FIELD_UT, sight_deg=_SIGHT_DEG)
    true = drawn.registers()
    errors = {
        name: (value - true[program][name]) / found.sigma[program][name]
        for program, values in found.registers.items()
        for name, value in values.items()
    }
    kinds = {"declared": {}, "found": found.registers, "true": true}
    return Trial(errors, {k: attitude_error(drawn, values, seed) for k, values in kinds.items()})


def attitude_error(of: Device, registers: Mapping[str, Mapping[str, float]], seed: int) -> float:
    """The rms error [deg] of `mekf`, fixed point, on a random motion with these registers."""
    log = synthetic_log(seconds=_FLIGHT_S, rate_hz=256.0, seed=seed, acceleration=0.3, mag_every=32)
    true = NineAxis.of(log)
    fields = np.where(true.mag_new[:, None], true.mag, 0.0)
    rng = np.random.default_rng([seed, 59])
    inertial, lines = of.counts(true.gyr, true.acc, fields, rng)
    p = dict[str, float]()
    for name, front in FRONT.items():
        p |= front().param_values(registers.get(name))

    def matrix(name: str) -> FloatArray:
        return np.array([[p[f"{name}_{r}{c}"] for c in AXES] for r in AXES])

    def vector(name: str) -> FloatArray:
        return np.array([p[f"{name}_{a}"] for a in AXES])

    gyr = inertial[:, :3] @ matrix("gyro").T - vector("gyro_bias")
    acc = inertial[:, 3:] @ matrix("acc").T - vector("acc_bias")
    mag = (lines - vector("field_bias")) @ matrix("field").T
    mag[~true.mag_new] = np.nan
    seen = NineAxis(log.name, true.t, gyr, acc, mag, true.q).record()
    filter = Mekf()
    (run,), *_ = run_forms(filter, [feed(filter, seen).inputs], levels=("c",))
    return attitude_errors(attitude_of(run.outputs), true.attitude, true.t > _ALIGNED_S)["total"]


def main(arguments: Sequence[str]) -> int:
    """Print the figures; return 1 if too many devices have a register beyond 3 uncertainties."""
    parser = argparse.ArgumentParser(prog="python -m boresight.sim.attitude.calibration")
    parser.add_argument("--runs", type=int, default=100, help="devices (%(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the first (%(default)s)")
    parser.add_argument("-o", "--output", type=Path, help="picture of the errors, FILE.png")
    given = parser.parse_args(arguments)
    trials = []
    try:
        require(given.runs >= 1, "--runs", "1 or more", given.runs)
        for seed in range(given.seed, given.seed + given.runs):
            trials.append(trial(seed))
            print(f"device {seed}: {trials[-1]}", file=sys.stderr, flush=True)
    except (InputError, ToolMissing) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    errors = np.array([[*t.errors.values()] for t in trials])
    attitudes = {kind: [t.attitude[kind] for t in trials] for kind in trials[0].attitude}
    if given.output is not None:
        _plot(errors, attitudes, given.output)
    worst = np.abs(errors).max(axis=1)
    share = float((worst <= _SIGMAS).mean())
    median = ", ".join(f"{kind} {np.median(values):.3f}" for kind, values in attitudes.items())
    count = errors.shape[1]
    print(f"all {count} registers within {_SIGMAS:g} uncertainties: {share:.0%} of the devices")
    print(
        f"errors in uncertainties: rms {np.sqrt((errors**2).mean()):.2f}, worst {worst.max():.2f}"
    )
    print(f"attitude, median rms, deg: {median}")
    return int(share < _SHARE)


def _plot(errors: FloatArray, attitudes: Mapping[str, Sequence[float]], path: Path) -> None:
    """Attitude errors of the devices in their order, and errors of all registers."""
    with settings():
        figure, (left, right) = figure_and_axes(3.2, 1, 2)
        for kind, colour, style in (
            ("declared", "grey", "-"),
            ("found", "heading", "-"),
            ("true", "pitch", "--"),
        ):
            count = np.arange(1, len(errors) + 1)
            left.plot(np.sort(attitudes[kind]), count, style, color=COLOUR[colour], label=kind)
        left.set(xlabel="rms error of the attitude [deg]", ylabel="devices with less")
        log_axis(left)
        legend(left, 3)
        edges = np.linspace(-4.0, 4.0, 33)
        right.hist(errors.ravel(), edges, color=COLOUR["sky"], label="registers of all devices")
        density = np.exp(-0.5 * edges**2) / np.sqrt(2.0 * np.pi)
        expected = density * errors.size * (edges[1] - edges[0])
        right.plot(edges, expected, color=INK, label="normal distribution")
        right.set(xlabel="error [stated uncertainties]", ylabel="registers")
        legend(right, 2)
        figure.savefig(path, dpi=130)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
