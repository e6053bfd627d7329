"""Combinations, the work that they share, and keys by what decides."""

import dataclasses

import pytest

from boresight import Record
from boresight.model.errors import InputError
from boresight.model.tolerances import tolerances
from boresight.sim.explore.cases import arguments_of, cases_of, planned
from boresight.sim.explore.figures import explored, quantities
from boresight.sim.explore.measure import Exploration, measured
from tests.support.smooth import LOG, Smooth

EXPLORATION = Exploration((LOG,))


def plan(name=Smooth, texts=(), words=(18, 32), configs=("small", "fast"), log=LOG, **more):
    _, arguments = arguments_of(texts)
    cases = cases_of(name, arguments, words=words, configs=configs, targets=("xc6slx9",))
    exploration = dataclasses.replace(EXPLORATION, **more)
    return planned(exploration, cases, [log], area=False)


def test_logs_and_arguments() -> None:
    logs, arguments = arguments_of(["a.csv", "taps=4,8", "mag=none,'all'", "./x=y.csv", LOG])
    assert logs == ["a.csv", "./x=y.csv", LOG]
    assert arguments == {"taps": [4, 8], "mag": ["none", "all"]}
    for text, message in (("taps=4,,", "wanted values of"), ("taps=1+", "wanted values of")):
        with pytest.raises(InputError, match=message):
            arguments_of([text])
    with pytest.raises(InputError, match="taps twice"):
        arguments_of(["taps=4", "taps=8"])


@pytest.mark.parametrize(
    ("name", "wanted"),
    [("mekf", "mekf(n=3)"), ("vqf(rate_hz=9)", "vqf(rate_hz=9, n=3)"), ("f.py:A()", "f.py:A(n=3)")],
)
def test_names_with_arguments(name, wanted) -> None:
    (case,) = cases_of(name, {"n": [3]}, words=[18], configs=["small"], targets=["xc6slx9"])
    assert case.named == wanted


def test_errors_are_shared_by_machines_and_a_refused_value_has_a_row() -> None:
    plans, tasks = plan(texts=["shift=2,-1"])
    assert [p.refused != "" for p in plans] == 4 * [False] + 4 * [True]
    assert "negative shift" in plans[4].refused and "\n" not in plans[4].refused
    kinds = [task.kind for task in tasks.values()]
    assert kinds == 2 * ["errors"] + 4 * ["cycles"], "the quick ones first"
    with pytest.raises(InputError, match="a name or a class"):
        _ = cases_of(Smooth(), {"shift": [1]}, words=[18], configs=["small"], targets=["t"])[
            0
        ].named


def test_keys_depend_on_what_decides() -> None:
    tasks = plan()[1]
    before = set(tasks)
    assert set(plan()[1]) == before
    assert len(before & set(plan(words=(20, 32))[1])) == 3  # what concerns 32 bits
    other = Record.of({"a": [0.3, -0.6, 0.8]}, name="log")
    shared = [tasks[key].kind for key in before & set(plan(log=other)[1])]
    assert shared == 4 * ["cycles"]
    assert not before & set(plan(texts=["shift=4"])[1])
    assert {tasks[k].kind for k in before & set(plan(steps=2)[1])} == {"cycles"}
    assert {tasks[k].kind for k in before & set(plan(urgent=1)[1])} == {"errors"}
    with tolerances(["m=1"]):
        assert {tasks[k].kind for k in before & set(plan()[1])} == {"cycles"}


def test_figures_of_a_row() -> None:
    plans, tasks = plan(texts=["shift=1"], words=(18,), configs=("small",))
    rows = dict(zip(tasks, measured(EXPLORATION, list(tasks.values())), strict=True))
    row = explored(plans[0], rows, EXPLORATION, clock_mhz=50.0)
    # Halves are exact in the output's word: m = 0.15, -0.225, 0.3375 in inputs of 18 bits.
    lsb = 2.0**-17
    assert 0.0 < row.errors["m"].largest < 2.0 * lsb and row.good and row.saturated == 0
    assert row.truth["m"].rms == pytest.approx(((0.05**2 + 0.1375**2) / 2) ** 0.5, abs=2 * lsb)
    assert row.truth["m"].largest == pytest.approx(0.1375, abs=2 * lsb)
    assert row.us == row.cycles / 50.0 and row.rate == pytest.approx(50e6 / row.interval)
    assert row.latencies["m"] <= row.interval and row.multiplications == 2
    figures = row.figures
    assert figures["tolerance"] == pytest.approx(row.errors["m"].largest / 1e-3)
    assert figures["cycles"] == row.cycles and "output.cycles" in figures
    names = {q.name for q in quantities(Smooth())}
    assert figures.keys() <= names and "m.truth_rms" in names and "lut" not in figures
    assert row.name == "shift=1, 18 bits, small, xc6slx9" and row.commands == ()


def test_what_cannot_be_measured_says_why() -> None:
    wrong = Record.of({"b": [1.0]}, name="log")
    plans, tasks = plan(words=(18,), configs=("small",), log=wrong)
    exploration = Exploration((wrong,))
    rows = dict(zip(tasks, measured(exploration, list(tasks.values())), strict=True))
    row = explored(plans[0], rows, exploration, clock_mhz=100.0)
    assert "wanted a column a" in row.refused and row.cycles is not None


def test_an_error_that_is_no_number_is_beyond_any() -> None:
    plans, tasks = plan(words=(18,), configs=("small",))
    error = {"unit": "", "largest": None, "rms": None, "tolerance": 1e-3, "good": False}
    rows = {k: {"errors": {"m": error}, "saturated": 0} for k, t in tasks.items()}
    row = explored(plans[0], rows, EXPLORATION, clock_mhz=100.0)
    assert row.figures["m"] == row.figures["tolerance"] == float("inf") and row.good is False
