"""Strangers' programs against truth: `accuracy` in their units, `tune` on data it has not seen."""

from __future__ import annotations

import json

import numpy as np
import pytest

from boresight.cli import main
from boresight.model.resolve import estimator_of
from boresight.sim.records.feed import feed
from boresight.sim.records.record import Record
from tests.support.strangers import STRANGERS, csv
from tests.support.strangers import program as place

#: Programs whose records have a truth, and its units; the error that they must stay below.
TRUTHS = {
    "kalman.py": {"pos": ("m", 0.2), "vel": ("m/s", 0.8)},
    "alphabeta.py": {"track": ("m", 3.0), "speed": ("m/s", 12.0)},
    "pendulum.py": {"angle": ("rad", 0.01), "rate": ("rad/s", 0.08)},
    "pll.py": {"phase": ("ht", 0.15), "frequency": ("Hz", 5.0)},
    "madgwick.py:Madgwick": {"total": ("deg", 8.0), "inclination": ("deg", 2.0)},
}
#: Programs with a bad start, and what falls to what share of it on other data.
STARTS = {
    "kalman.py": ({"q": 0.01, "r": 4.0}, {"pos": 0.5, "vel": 0.5}),
    "alphabeta.py": ({"alpha": 0.9, "beta": 0.6}, {"track": 0.7, "speed": 0.7}),
    "pll.py": ({"kp": 0.01, "ki": 0.1}, {"phase": 0.5, "frequency": 0.5}),
    "madgwick.py:Madgwick": ({"beta": 1.0}, {"inclination": 0.9}),
}


def settled(values: tuple) -> tuple:
    """A record of which the start, in which a filter settles, does not count."""
    columns, heads = values
    return {**columns, "mov": 1.0 * (np.arange(len(next(iter(columns.values())))) >= 400)}, heads


def numpy_outputs(program: str, columns: dict) -> tuple:
    """What a program reads, and its outputs with plain numpy."""
    estimator = estimator_of(program)
    feed_columns = feed(estimator, Record.of(columns))
    run = estimator.run_float(feed_columns.inputs[:, :, None]).outputs
    return feed_columns, {n: v[:, 0] for n, v in run.items()}


@pytest.mark.parametrize("name", TRUTHS)
def test_accuracy_in_the_units_of_the_outputs(name: str, tmp_path, capsys) -> None:
    """A CSV in other units; RMS by hand of numpy's float64."""
    values = settled(STRANGERS[name](1500))
    log, program = csv(tmp_path / "log.csv", values), place(name)
    assert main(["accuracy", program, str(log), "--json"]) == 0
    fixed, floating = json.loads(capsys.readouterr().out)["estimators"]
    assert all(d["good"] and d["tolerance"] is not None for d in fixed["vs_float"][:4])
    fed, outputs = numpy_outputs(program, values[0])
    for figure, (unit, most) in TRUTHS[name].items():
        assert fixed["units"][figure] == unit
        assert 0.0 < fixed["mean"][figure] < most
        assert fixed["mean"][figure] == pytest.approx(floating["mean"][figure], rel=1e-2)
        if figure in outputs and figure in fed.truth:
            error = (outputs[figure] - fed.truth[figure])[400:]
            error = (error + 1.0) % 2.0 - 1.0 if unit == "ht" else error
            rms = float(np.sqrt(np.mean(error**2)))
            assert floating["mean"][figure] == pytest.approx(rms, rel=1e-6)


@pytest.mark.parametrize("name", STARTS)
def test_tuned_parameters_help_on_data_that_they_were_not_tuned_on(
    name: str, tmp_path, capsys
) -> None:
    start, wanted = STARTS[name]
    program, make = place(name), STRANGERS[name]
    logs = [csv(tmp_path / f"log{seed}.csv", settled(make(1200, seed))) for seed in (21, 22, 23)]
    other = csv(tmp_path / "other.csv", settled(make(1700, 31)))
    out = tmp_path / "tuned.json"
    values = [x for n, v in start.items() for x in ("--param", f"{n}={v}")]
    line = ["tune", program, *map(str, logs), "--rounds", "8", "-o", str(out), "-q", *values]
    assert main(line) == 0
    capsys.readouterr()

    def errors(*options: str) -> dict:
        assert main(["accuracy", program, str(other), "--json", *options]) == 0
        return json.loads(capsys.readouterr().out)["estimators"][0]["mean"]

    before, after = errors(*values), errors("--param", f"@{out}")
    for figure, share in wanted.items():
        assert after[figure] < share * before[figure], (before, after)
    data = json.loads(out.read_text())
    for figure in wanted:  # as cross-validation inside the tuned logs foretold
        assert after[figure] == pytest.approx(
            data["cross_validation"]["mean_test_error"][figure], rel=0.6
        )
