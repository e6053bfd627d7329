"""`check` names what is wrong in fixed point: the value, the author's line, and a remedy."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import boresight
from boresight import Estimator, Input, Output, kalman, ops
from boresight.cli import main

BAD = Path(__file__).with_name("bad.py")
N = 900
_K = np.arange(N)

#: Record of each, and what its line says.
CASES = {
    "Integrator": ({"rate": np.full(N, 9.0)}, "does not fit its range [-45, 45]"),
    "Hope": (
        {"a": 2.0 * np.sin(0.1 * _K), "b": 1.0 + _K / N},
        "does not fit its range [-1, 1]; widen the range (declared: both are small)",
    ),
    "NegativeRoot": ({"c": 3.0 + 0.0 * _K, "a": 2.9 + 1e-3 * _K}, "rsqrt: argument -"),
    "SmallDivisor": (
        {"range": 100.0 - 0.1 * _K, "speed": 80.0 * 0.985**_K},
        "does not fit its range [0, 50]; widen the range (declared: near enough)",
    ),
    "CoarseFilter": ({"x": 40.0 * np.sin(0.002 * _K)}, "rounding adds up"),
}


def log(path: Path, columns: dict[str, np.ndarray]) -> str:
    rows = np.column_stack(list(columns.values())).tolist()
    body = "".join(",".join(map(repr, row)) + "\n" for row in rows)
    path.write_text(",".join(columns) + "\n" + body)
    return str(path)


def lines_of(name: str) -> set[int]:
    """Lines of a class that carry its fault."""
    text = BAD.read_text().splitlines()
    first = next(k for k, line in enumerate(text) if line.startswith(f"class {name}("))
    rest = range(first + 1, len(text))
    last = next((k for k in rest if text[k].startswith("class ")), len(text))
    return {k + 1 for k in range(first, last) if "# FAULT" in text[k]}


@pytest.mark.parametrize("name", CASES)
def test_the_culprit_is_named(name: str, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    columns, said = CASES[name]
    word = "18" if name == "CoarseFilter" else "32"
    line = ["check", f"{BAD}:{name}", log(tmp_path / "log.csv", columns), "--word", word, "-q"]
    assert main([*line, "--levels", "fixed,c"]) == 1
    text = capsys.readouterr().out
    assert f"[0/{N}] mismatches" in text  # all levels agree on what is wrong
    (first,) = [x for x in text.splitlines() if "first wrong: " in x]
    place = re.search(r"bad\.py, line (\d+)", first)
    assert said in first and place is not None and int(place[1]) in lines_of(name), first
    assert text.splitlines()[-1].startswith("FAILED: ")


def test_a_state_within_its_range_is_not(tmp_path, capsys) -> None:
    path = log(tmp_path / "log.csv", {"rate": np.full(400, 9.0)})
    assert main(["check", f"{BAD}:Integrator", path, "--levels", "fixed,c", "-q"]) == 0
    assert "BEYOND its declared range" not in capsys.readouterr().out


class Near(Estimator):
    """A root whose argument comes near to the least that a word normalises."""

    inputs = (Input("a", 0.0, 1.0),)
    outputs = (Output("y", tolerance=1e-2),)

    def step(self, x, u, p):
        return {}, {"y": u.a * ops.rsqrt(ops.maximum(u.a, 2.0**-24))}


class Spread(kalman.Kalman):
    """A measurement whose h P h + r spans more than its word holds."""

    inputs = (Input("z", -100.0, 100.0),)
    states = (kalman.State("v", -100.0, 100.0, sd=50.0),)
    outputs = (Output("v", tolerance=1e-3),)

    def noise(self, x, u, p):
        return {"v": 1e-6}

    def measure(self, x, u, p):
        return [kalman.Measurement(u.z, 0.5 * x.v, 1e-4)]


def test_an_argument_near_its_floor_is_a_warning() -> None:
    (result,) = boresight.check(Near, {"a": 0.5 ** _K[:22]}, levels=("fixed",))["results"]
    (text,) = result.to_json()["warnings"]
    assert result.good and "the smallest" in text and f"  warning: {text}" in result.lines()
    (result,) = boresight.check(Near, {"a": 0.5 ** _K[:10]}, levels=("fixed",))["results"]
    assert result.good and not any("warning: " in x for x in result.lines())


class Pulled(Spread):
    """A state that another one moves farther than its own standard deviation."""

    inputs = (Input("z", -100.0, 100.0), Input("dt", 0.0, 2.0, "s"))
    states = (
        kalman.State("v", -100.0, 100.0, sd=0.5, sd_max=1.0),
        kalman.State("a", -100.0, 100.0, sd=0.5, sd_max=50.0),
    )

    def f(self, x, u, p):
        return {"v": x.v + u.dt * x.a}

    def measure(self, x, u, p):
        return [kalman.Measurement(u.z, x.v, 1e-4)]


def test_what_widens_a_predicted_variance_is_named_and_each_cure_helps() -> None:
    """64 = the largest growth that `Kalman` allows."""
    log = {"z": np.random.default_rng(1).normal(0.0, 0.01, 400), "dt": np.full(400, 0.01)}
    (result,) = boresight.check(Pulled, log, levels=("fixed",), word=24)["results"]
    said = (
        r"narrow the range of dt \(one prediction may take the standard deviation of v from 1 to "
    )
    said += r"64\); sd_max of a .* wastes 13 bits: sd_max=(\S+) suffices"
    found = re.search(said, str(result))
    assert found, str(result)
    z, dt, v, a = *Pulled.inputs, *Pulled.states
    for cure in (
        {"inputs": (z, replace(dt, high=0.02))},
        {"states": (v, replace(a, sd_max=float(found[1])))},
    ):
        cured = type("Pulled", (Pulled,), cure)
        (after,) = boresight.check(cured, log, levels=("fixed",), word=24)["results"]
        assert "one prediction may take" not in str(after)
        largest = [r.accuracy.differences[0].largest for r in (result, after)]
        assert largest[1] < 0.5 * largest[0]


@pytest.mark.parametrize(("variance", "told"), [(1e-6, True), (1e6, False)])
def test_no_range_is_narrowed_to_a_wider_one(variance: float, told: bool) -> None:
    """Noise alone may be wider than the largest standard deviation."""

    class Noisy(Pulled):
        def noise(self, x, u, p):
            return {"v": variance}

    noisy = Noisy()
    noisy.compile()
    assert ("narrow the range of dt" in str(noisy.remedies)) == told


def test_a_wide_variance_of_an_innovation_asks_for_sd_max() -> None:
    log = {"z": np.random.default_rng(1).normal(0.0, 0.01, 400)}
    (result,) = boresight.check(Spread, log, levels=("fixed",), word=24)["results"]
    assert not result.good and "sd_max" in result.accuracy.culprit
