"""`boresight explore`: the rows, what they depend on, the choice, and what `check` refuses."""

from __future__ import annotations

import json
import shlex

import pytest

import boresight
from boresight import Record
from boresight.cli import main
from boresight.model.errors import InputError
from boresight.sim.explore.measure import (
    Case,
    Exploration,
    Task,
    arguments_of,
    cases_of,
    digest_of,
    measured,
)
from boresight.verbs.explore import FIGURES, Quantity, demands_of

SOURCE = """
from boresight import Estimator, Input, Output, State, World


class Smooth(Estimator):
    inputs = (Input("a", -1.0, 1.0, "V"),)
    states = (State("m", -1.0, 1.0, "V"),)
    outputs = (Output("m", "V", tolerance=1e-3),)

    def __init__(self, shift=3):
        if shift < 0:
            raise ValueError("negative shift")
        self.gain = 2.0**-shift

    def step(self, x, u, p):
        m = (1.0 - self.gain) * x.m + self.gain * u.a
        return {"m": m}, {"m": m}


class Turn(World):
    def pieces(self):
        yield {"a": [0.3, -0.6, 0.9], "m_true": [0.1, -0.225, 0.2]}


class Wound(Smooth):
    states = (State("m", -1.0, 1.0, "V"), State("sum", -2.0, 2.0, "V"))

    def step(self, x, u, p):
        m = (1.0 - self.gain) * x.m + self.gain * u.a
        return {"m": m, "sum": x.sum + 1.0}, {"m": m}
"""
WORDS = ("--word", "18,32")


def log(amplitude: float = 1.0) -> str:
    return "a\n" + "".join(f"{amplitude * ((k * 7 % 11) / 11 - 0.4)}\n" for k in range(30))


@pytest.fixture
def here(tmp_path, monkeypatch):
    (tmp_path / "smooth.py").write_text(SOURCE)
    (tmp_path / "log.csv").write_text(log())
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(name="smooth.py:Smooth", given="log.csv", words=(18, 32), **more):
    return boresight.explore(name, given, words=words, jobs=1, **more)


def test_rows_choice_and_files(here, capsys) -> None:
    line = ["explore", "smooth.py:Smooth", "log.csv", "shift=3,-1", *WORDS, "--jobs", "1"]
    assert main([*line, "--want", "m.rms<1uV, us<1", "--least", "cycles"]) == 0
    out = capsys.readouterr().out
    assert " m.rms " in out and " us " in out and "clock" not in out
    assert "cycles 10: shift=3, 32 bits, small" in out
    assert "boresight compile" in (here / "build" / "explore-smooth.html").read_text()
    assert main([*line, "--want", "m<1uV, cycles<3", "--json"]) == 1
    data = json.loads(capsys.readouterr().out)
    assert data["choice"]["row"] is None and data["choice"]["missed"] == ["cycles<3"]
    assert len(data["rows"]) == 8 and data["good"] is False


def test_figures_are_those_of_the_arithmetic(here) -> None:
    given = {"a": [0.3, -0.6, 0.9], "m_true": [0.1, -0.225, 0.2]}
    row = run("smooth.py:Smooth(1)", given, words=(18,), clock=50.0)["rows"][0]
    world = run("smooth.py:Smooth(1)", "smooth.py:Turn", words=(18,), clock=50.0)["rows"][0]
    assert world.pop("commands")[1].startswith("boresight check 'smooth.py:Smooth(1)' smooth.py:T")
    assert row.items() >= world.items()
    # Halves are exact in the output's word: m = 0.15, -0.225, 0.3375 in inputs of 18 bits.
    lsb = 2.0**-17
    assert 0.0 < row["m"] < 2.0 * lsb and row["good"] and row["saturated"] == 0
    assert row["m.truth"] == pytest.approx(((0.05**2 + 0.1375**2) / 3) ** 0.5, abs=2 * lsb)
    assert row["tolerance"] == pytest.approx(row["m"] / 1e-3)
    assert row["us"] == row["cycles"] / 50.0 and row["rate"] == pytest.approx(
        50e6 / row["interval"]
    )


def test_another_log_of_the_same_name_is_measured_again(here) -> None:
    first = run(words=(18,))
    (here / "log.csv").write_text(log(0.01))
    second = run(words=(18,))
    assert second["rows"] == run(words=(18,), output="other")["rows"]
    assert second["rows"][0]["m"] != first["rows"][0]["m"]


def test_a_log_that_changes_while_it_is_explored_gives_no_figures(here) -> None:
    (case,) = cases_of("smooth.py:Smooth", {}, words=[18], configs=["small"], targets=["xc6slx9"])
    before = digest_of([boresight.record_of("log.csv")])
    (here / "log.csv").write_text(log(0.01))
    (row,) = measured(Exploration(("log.csv",), digest=before), [Task("errors", case)])
    assert "wanted the logs as they were" in row["refused"]


def test_what_check_refuses_is_not_chosen_and_says_why(here, capsys) -> None:
    result = run("smooth.py:Wound", words=(18,), least="cycles")
    assert not result.good and result["choice"]["row"] is None
    assert all("SATURATED" in row["reason"] for row in result["rows"])
    assert main(["check", "smooth.py:Wound", "log.csv", "--levels", "c"]) == 1
    assert "SATURATED" in capsys.readouterr().out


def test_nothing_is_measured_twice_and_an_interrupted_run_continues(here, monkeypatch) -> None:
    kinds: list[str] = []

    def some(exploration, tasks):
        if len(kinds) == 3:
            raise KeyboardInterrupt
        kinds.extend(task.kind for task in tasks)
        return measured(exploration, tasks)

    monkeypatch.setattr("boresight.sim.explore.measure.measured", some)
    with pytest.raises(KeyboardInterrupt):
        run()
    del kinds[:]
    first = run()
    assert kinds == 3 * ["cycles"]
    del kinds[:]
    assert run()["rows"] == first["rows"] and not kinds
    run(words=(20,))
    assert kinds == ["errors", "cycles", "cycles"]
    del kinds[:]
    with pytest.raises(KeyboardInterrupt):
        run(again=True)
    assert len(kinds) == 3


def test_the_check_that_follows_has_the_same_settings(here, capsys) -> None:
    """Tolerances and rows, in every process and in the commands."""
    given = ("--tolerance", "m=1e-9V", "--every", "2", "--jobs", "2")
    assert main(["explore", "smooth.py:Smooth", "log.csv", *WORDS, *given, "--json"]) == 0
    narrow, row, *_ = json.loads(capsys.readouterr().out)["rows"]
    assert "wanted an LSB of at most 1e-09, for the tolerance of output m" in narrow["reason"]
    thin = [(k * 7 % 11) / 11 - 0.4 for k in range(1, 30, 2)]
    assert row["m"] == run(given={"a": thin}, words=(32,), output="b")["rows"][0]["m"]
    assert row["tolerance"] == pytest.approx(row["m"] / 1e-9) and row["good"]
    made, checked = row["commands"]
    assert " --tolerance m=1e-9V " in made and checked.endswith("m=1e-9V --every 2")
    assert main([*shlex.split(checked)[1:], "--levels", "fixed"]) == 0


def test_area_of_18_bits(here) -> None:
    """A word of 18 bits takes one multiplier block."""
    record = boresight.record_of("log.csv")
    case = Case("smooth.py:Smooth", (), 18, "small", "xc6slx9")
    (row,) = measured(Exploration((record,), digest=digest_of([record])), [Task("area", case)])
    assert row["dsp"] == 1 and 200 < row["lut"] < 400 and row["clock"] > 50.0


def test_arguments_of_the_constructor() -> None:
    record = Record.of({"a": [0.1]}, name="log")
    logs, arguments = arguments_of(["a.csv", "taps=4,8", "mag=none,'all'", "./x=y.csv", record])
    assert logs == ["a.csv", "./x=y.csv", record]
    assert arguments == {"taps": [4, 8], "mag": ["none", "all"]}
    for name, wanted in (("mekf", "mekf(n=3)"), ("f.py:A(b=9)", "f.py:A(b=9, n=3)")):
        (case,) = cases_of(name, {"n": [3]}, words=[18], configs=["small"], targets=["xc6slx9"])
        assert case.named == wanted


KNOWN = [Quantity("angle", "ht"), *FIGURES]


def test_demands_convert_units() -> None:
    first, second = demands_of("angle<0.018deg, dsp <= 1", KNOWN)
    assert first.limit == pytest.approx(1e-4) and str(second) == "dsp<=1"
    assert second.meets({"dsp": 1}) and not first.meets({"angle": 1e-4})
    assert not first.meets({"angle": None}) and not first.meets({})


@pytest.mark.parametrize("text", ["angel<1", "angle=1", "angle<1e", "angle<inf", "angle<1 s"])
def test_bad_demands(text) -> None:
    with pytest.raises(InputError) as error:
        demands_of(text, KNOWN)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--least", "size"], "least: wanted one of"),
        (["--config", "large"], "config: wanted one of small"),
        (["--target", "xc7"], " names, nearest: xc6slx"),
        (["--want", "lut<900"], "want: wanted areas and clocks, for lut, found no --synth"),
        (["shift=-1"], "negative shift"),
    ],
)
def test_bad_input_is_one_line(here, more, message, capsys) -> None:
    assert main(["explore", "smooth.py:Smooth", "log.csv", *more]) == 2
    err = capsys.readouterr().err
    assert message in err and err.count("\n") == 1
    assert not (here / "build").exists()
