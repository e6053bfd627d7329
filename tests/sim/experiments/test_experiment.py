"""Experiments: names, seeds, targets, page."""

import math
from pathlib import Path

import numpy as np
import pytest

import boresight
from boresight.model.errors import InputError
from boresight.model.resolve import estimator_of
from boresight.sim.attitude.ma2014.experiment import Ma2014
from boresight.sim.experiments.experiment import Experiment, Result, Target, grouped
from boresight.sim.experiments.forms import schedules_of
from boresight.sim.experiments.page import Section, numbers, render
from boresight.sim.experiments.registry import experiment_of
from boresight.sim.experiments.seeds import Runs, run_cases, spreads_of
from boresight.sim.experiments.targets import targets_of
from boresight.systems.array.experiment import Array
from boresight.systems.mls.experiment import Mls
from boresight.systems.radar.experiment import Radar
from boresight.systems.satcom.experiment import Satcom
from tests.support.strangers import EXAMPLES

# -- A target's band, what counts for the verdict, and how an experiment names itself -------------


@pytest.mark.parametrize(
    ("value", "low", "high", "good"),
    [
        (1.0, 1.0, 2.0, True),
        (2.0, 1.0, 2.0, True),
        (0.999, 1.0, 2.0, False),
        (2.001, 1.0, 2.0, False),
        (-9.0, None, 2.0, True),
        (9.0, 1.0, None, True),
        (9.0, None, None, True),
        (math.nan, None, None, False),
        (math.inf, 1.0, None, False),
    ],
)
def test_band(value, low, high, good):
    target = Target(name="x", source="s", value=value, low=low, high=high)
    assert target.good is good
    assert target.to_json() == {
        "name": "x",
        "source": "s",
        "value": value if math.isfinite(value) else None,
        "limit": [low, high],
        "pass": good,
    }


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"value": 1.0, "high": "0.2"}, "target x: wanted high: a number, found '0.2'; write it"),
        ({"value": None}, "target x: wanted value: a number, found None"),
        ({"value": 1.0, "low": 3.0, "high": 2.0}, "low up to high, found low 3, high 2"),
    ],
)
def test_limits_that_no_value_can_meet_are_refused(given, said):
    with pytest.raises(InputError) as error:
        Target(name="x", source="s", **given)
    assert said in str(error.value)


def test_parts_are_named_and_stand_together():
    def one(name, part, source="s"):
        return Target(name=name, part=part, source=source, value=0.0)

    all_of_them = [one("a", "x"), one("a", "y"), one("a", "x", "other"), one("b", "")]
    assert [t.to_json()["name"] for t in all_of_them] == ["a, x", "a, y", "a, x", "b"]
    assert [[t.part for t in g] for g in grouped(all_of_them)] == [["x", "y"], ["x"], [""]]


def test_a_missed_target_counts_if_it_binds():
    def missed(binding):
        return Target(name="x", source="s", value=2.0, high=1.0, binding=binding)

    met = Target(name="y", source="s", value=0.0, high=1.0)
    assert Result(figures={}, targets=(met, missed(False))).good
    assert not Result(figures={}, targets=(met, missed(True))).good
    assert not Result(figures={}, targets=(Target(name="x", source="s", value=2.0, high=1.0),)).good


def test_name_and_summary_unless_given():
    class Tracking(Experiment):
        """A target on a circle.

        More.
        """

    class Other(Tracking):
        """Another."""

        name, summary = "third", "Given."

    assert (Tracking.name, Tracking.summary) == ("tracking", "A target on a circle.")
    assert (Other.name, Other.summary, Other.runs, Other.pages) == ("third", "Given.", 100, ())
    with pytest.raises(NotImplementedError):
        Tracking().run(seed=0, runs=2, say=print)


# -- experiments by name, by class, and in a file of one's own ------------------------------------


def test_ours_by_name_class_and_object():
    for kind in (Array, Ma2014, Mls, Radar, Satcom):
        assert type(experiment_of(kind.name)) is kind
    experiment = experiment_of("ma2014")
    assert isinstance(experiment, Ma2014) and experiment_of(experiment) is experiment
    assert isinstance(experiment_of(Ma2014), Ma2014)


def test_in_a_file(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(
        "from boresight import Experiment\n\n\nclass Mine(Experiment):\n"
        "    def __init__(self, sites=1):\n        self.sites = sites\n"
    )
    result = experiment_of(f"{path}:Mine(sites=3)")
    assert (result.name, result.sites) == ("mine", 3)


def test_unknown():
    with pytest.raises(InputError, match="^experiment: wanted file.py:Class, or one of array, "):
        experiment_of("ma2015")


# -- cases of many seeds: the same figures however they are dealt out -----------------------------


def squares(case: float, seeds: range) -> Runs:
    """A figure for each way of pooling, of the seeds."""
    values = case * np.array(seeds, dtype=float)
    names = ("angle_rms", "peak_max", "count_sum", "rate", "max_share")
    return Runs({n: values for n in names}, {"first": values[0]}, [*seeds])


CASES = [("one", 1.0, 5), ("ten", 10.0, 2)]


@pytest.mark.parametrize("at_once, jobs", [(5, 1), (2, 1), (2, 2)])
def test_portions_and_processes_change_nothing(at_once: int, jobs: int) -> None:
    messages: list[str] = []
    result = run_cases(squares, CASES, seed=3, at_once=at_once, jobs=jobs, say=messages.append)
    assert list(result) == ["one", "ten"]
    assert result["one"].figures["rate"].tolist() == [3.0, 4.0, 5.0, 6.0, 7.0]
    assert result["ten"].figures["rate"].tolist() == [30.0, 40.0]
    assert result["one"].shown == {"first": 3.0} and result["one"].each == [3, 4, 5, 6, 7]
    tasks = {5: 2, 2: 4}[at_once]
    assert messages[0] == f"2 cases, 7 runs in {tasks} tasks" and len(messages) == 1 + tasks
    assert messages[-1].startswith(f"{tasks} of {tasks} after ")


def test_pooled() -> None:
    assert squares(1.0, range(3, 5)).pooled() == {
        "angle_rms": pytest.approx(np.sqrt(12.5)),
        "peak_max": 4.0,
        "count_sum": 7.0,
        "rate": 3.5,
        "max_share": 3.5,
    }


def test_pooling_that_the_name_does_not_say() -> None:
    values = np.array([1.0, 7.0])
    ways = {"a_deg": "rms", "b_max": "sum", "c_ms": "max"}
    parts = [Runs({n: values[k : k + 1] for n in (*ways, "d")}, {}, [], ways) for k in range(2)]
    result = run_cases(
        lambda case, seeds: parts[seeds[0]],
        [("one", 0, 2)],
        seed=0,
        at_once=1,
        jobs=1,
        say=lambda text: None,
    )
    assert result["one"].pooled() == {"a_deg": 5.0, "b_max": 8.0, "c_ms": 7.0, "d": 4.0}
    names = ("x_one_a_deg", "x_one_b_max", "x_one_c_ms", "x_one_d")
    assert spreads_of(result, "x_") == dict.fromkeys(names, (1.0, 7.0))


# -- targets from a table: figures, ratios, differences, limits that are not there, notes ---------

TABLE = """figure,over,less,source,name,low,high,prototype,unit,note,reported
a,,,step 1,"plain, x",,0.5,0.25,deg,,
a,b,,step 2,ratio,0.1,,,,and so,
a,,b,step 3,difference,-4,-3,,,because,yes
b,,,step 4,shown,,,,s,,
"""


def table(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, text: str, **inputs
) -> tuple[Target, ...]:
    (tmp_path / "targets.csv").write_text(text)
    monkeypatch.setattr("boresight.sim.experiments.targets.files", lambda package: tmp_path)
    return targets_of("any", {"a": 1.0, "b": 4.0}, **inputs)


def test_rows(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    spreads = {"a": (0.5, 2.0)}
    result = table(monkeypatch, tmp_path, TABLE, spreads=spreads)
    named = {"source": "step 1", "unit": "deg", "beside": {"prototype": 0.25}}
    assert result == (
        Target(name="plain, x", value=1.0, high=0.5, spread=(0.5, 2.0), **named),
        Target(name="ratio", source="step 2", value=0.25, low=0.1, note="and so"),
        Target(
            name="difference",
            source="step 3",
            value=-3.0,
            low=-4.0,
            high=-3.0,
            binding=False,
            note="because",
        ),
        Target(name="shown", source="step 4", value=4.0, unit="s"),
    )
    assert [t.good for t in result] == [False, True, True, True]


def test_columns_that_may_be_left_out(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    text = "figure,source,name,low,high\nb,ours,one,3,\n"
    assert table(monkeypatch, tmp_path, text) == (
        Target(name="one", source="ours", value=4.0, low=3.0),
    )


def test_with_too_few_runs_a_band_is_not_judged(monkeypatch, tmp_path: Path) -> None:
    text = "figure,source,name,low,high,runs\na,ours,one,3,,100\n"
    (few,), (enough,) = (table(monkeypatch, tmp_path, text, runs=n) for n in (99, 100))
    assert (few.judged, few.good, enough.judged, enough.good) == (False, True, True, False)
    said = "not judged with fewer than 100 runs"
    assert said in render("own", [], [few], []) and said not in render("own", [], [enough], [])


# --------------------------------------------------------------------------------------------------
# the page of an experiment: targets with their verdicts, tables, figures, nothing from outside


def page() -> str:
    targets = [
        Target(name="one", source="step 1", value=0.5, high=1.0, beside={"prototype": 0.3}),
        Target(name="both", source="step 1", value=-0.25, low=-0.4, high=-0.1),
        Target(name="two <b>", part="x", source="step 2", value=0.5, low=2.0, spread=(0.25, 0.75)),
        Target(name="three", source="step 3", value=0.25, unit="deg", beside={"paper": 9.0}),
    ]
    sections = [
        Section(title="Table", text="Some text.", columns=("case", "a"), rows=[["good", 0.0123]]),
        Section(title="Plot", figures=[("what it shows", "<svg>drawn</svg>")]),
    ]
    return render("own", ["Beginning.", "More."], targets, sections)


def test_targets() -> None:
    text = page()
    assert text.count('class="ok"') == 2 and text.count('class="bad"') == 1
    assert "Targets met: 2 of 3." in text  # what has no limits is shown, not judged
    assert "two &lt;b&gt;, x" in text and "&ge; 2" in text and "&le; 1" in text
    assert ">\N{MINUS SIGN}0.4 to \N{MINUS SIGN}0.1<" in "".join(text.split("\n"))
    assert ">note" not in text and "(reported)" not in text
    assert "0.25 to 0.75" in text and "0.25 deg" in text
    assert '<th class="r">prototype' in text and '<th class="r">paper' in text


def test_what_is_reported_only() -> None:
    missed = Target(name="n", source="s", value=3.0, high=2.0, binding=False, note="limited so")
    text = render("own", [], [missed], [])
    assert "FAIL</span> (reported)" in text and ">note" in text and "limited so" in text


def test_sections() -> None:
    text = page()
    for wanted in ("<h2>Table</h2>", "Some text.", "<th>case", ">0.0123<", "<svg>drawn</svg>"):
        assert wanted in text, wanted
    assert "<figcaption>what it shows" in text and "Beginning." in text and "More." in text


def test_nothing_from_outside() -> None:
    assert "http" not in page() and "<script" not in page() and page() == page()


def test_numbers_of_one_cell() -> None:
    assert numbers([1.0, -2.345]) == "1.00, \N{MINUS SIGN}2.35"  # -2.345 lies just below
    assert numbers([0.00123, -4e-9], ".1e") == (
        "1.2e\N{MINUS SIGN}03, \N{MINUS SIGN}4.0e\N{MINUS SIGN}09"
    )


# -- forms of an estimator: those that `run` runs, the cycles that `compile` reports --------------


def test_schedules_are_those_of_the_compiled_core(tmp_path: Path) -> None:
    names = [str(EXAMPLES / f"{name}.py") for name in ("kalman", "biquad")]
    result = schedules_of(*map(estimator_of, names))
    assert list(result) == ["small", "fast"]
    for config, schedules in result.items():
        core = boresight.compile(*names, config=config, synth=False, output=tmp_path / config)
        for schedule, program in zip(schedules, core["programs"].values(), strict=True):
            assert schedule.interval == program["timing"]["interval_cycles"]
            assert schedule.latency == program["timing"]["latency_cycles"]["predicted"]
