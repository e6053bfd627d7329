"""``python -m boresight.sim.attitude.calibration``: calibrate simulated devices.

``--records FOLDER`` writes the records of one device instead, and its registers in true.json.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from boresight.model.errors import InputError, ToolMissing
from boresight.sim.attitude.calibration.campaign import Trial, trial
from boresight.sim.attitude.calibration.world import calibration_records, device
from boresight.sim.plotting import COLOUR, INK, figure_and_axes, legend, log_axis, settings
from boresight.sim.records.files import content_of

#: Uncertainties within which all registers of a device shall be, and the share of devices.
_SIGMAS, _SHARE = 3.0, 0.95


def main(arguments: Sequence[str]) -> int:
    """Print the figures; return 1 if too many devices have a register beyond 3 uncertainties."""
    parser = argparse.ArgumentParser(prog="python -m boresight.sim.attitude.calibration")
    parser.add_argument("--runs", type=int, default=100, help="devices (%(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the first (%(default)s)")
    parser.add_argument("--records", type=Path, help="folder for the records of one device")
    parser.add_argument("-o", "--output", type=Path, help="picture of the errors, FILE.png")
    given = parser.parse_args(arguments)
    if given.records is not None:
        _write(given.records, given.seed)
        return 0
    try:
        trials = []
        for seed in range(given.seed, given.seed + given.runs):
            trials.append(trial(seed))
            print(f"device {seed}: {_line(trials[-1])}", file=sys.stderr, flush=True)
    except (InputError, ToolMissing) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    if given.output is not None:
        _plot(trials, given.output)
    worst = np.array([max(map(abs, t.errors.values())) for t in trials])
    share = float((worst <= _SIGMAS).mean())
    names, every = len(trials[0].errors), np.array([[*t.errors.values()] for t in trials])
    median = {
        kind: float(np.median([t.attitude[kind] for t in trials])) for kind in trials[0].attitude
    }
    print(f"all {names} registers within {_SIGMAS:g} uncertainties: {share:.0%} of the devices")
    print(f"errors in uncertainties: rms {np.sqrt((every**2).mean()):.2f}, worst {worst.max():.2f}")
    print("attitude, median rms, deg: " + ", ".join(f"{k} {v:.3f}" for k, v in median.items()))
    return int(share < _SHARE)


def _line(one: Trial) -> str:
    name, error = max(one.errors.items(), key=lambda item: abs(item[1]))
    angles = ", ".join(f"{kind} {value:.3f}" for kind, value in one.attitude.items())
    return f"worst register {name} {error:+.2f} uncertainties; attitude, deg: {angles}"


def _plot(trials: Sequence[Trial], path: Path) -> None:
    """Attitude errors of the devices in their order, and errors of all registers."""
    errors = np.array([[*t.errors.values()] for t in trials])
    with settings():
        figure, (left, right) = figure_and_axes(3.2, 1, 2)
        for kind, colour in (("declared", "grey"), ("found", "heading"), ("true", "pitch")):
            values = np.sort([t.attitude[kind] for t in trials])
            style = "--" if kind == "true" else "-"
            left.plot(
                values, np.arange(1, len(values) + 1), style, color=COLOUR[colour], label=kind
            )
        left.set(xlabel="rms error of the attitude [deg]", ylabel="devices with less")
        log_axis(left)
        legend(left, 3)
        edges = np.linspace(-4.0, 4.0, 33)
        right.hist(errors.ravel(), edges, color=COLOUR["sky"], label="registers of all devices")
        normal = (
            np.exp(-0.5 * edges**2) / np.sqrt(2.0 * np.pi) * errors.size * (edges[1] - edges[0])
        )
        right.plot(edges, normal, color=INK, label="normal distribution")
        right.set(xlabel="error [stated uncertainties]", ylabel="registers")
        legend(right, 2)
        figure.savefig(path, dpi=130)


def _write(folder: Path, seed: int) -> None:
    drawn = device(seed)
    folder.mkdir(parents=True, exist_ok=True)
    for record in calibration_records(drawn, seed):
        (folder / f"{record.name}.csv").write_bytes(content_of("log.csv", record))
    (folder / "true.json").write_text(json.dumps({"parameters": drawn.registers()}, indent=1))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
