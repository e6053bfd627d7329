"""The proof itself: it passes on the shipped filters and fails on every kind of fault."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from boresight.gateware.core import Core
from boresight.model.attitude import estimator
from boresight.model.attitude.complementary import Complementary
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.model.resolve import estimator_of
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import verdict
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import CModel
from boresight.sim.records.files import Log, bundled, read_record
from boresight.sim.records.record import Record


class Faster(Complementary):
    """The same with gains of twice the size."""

    name = "faster"
    params = tuple(
        dataclasses.replace(q, default=2.0 * q.default) if q.name.startswith("k") else q
        for q in Complementary.params
    )


PAIR = (Complementary, Faster)


@pytest.fixture(scope="module")
def log():
    return read_record(bundled("ximu_walk"))


def checked(log, steps, *names, build=None, **options):
    """Results of the first records."""
    build = build or Build(*(estimator_of(n) for n in names or PAIR[:1]))
    return Check(build, **options).run(log.head(steps))


@pytest.mark.parametrize("config", ["small", "fast"])
def test_all_levels_agree_on_recorded_data(log, config):
    (result,) = checked(log, 500, build=Build(estimator("complementary"), config=config))
    assert result.good
    levels = {(r.level, r.simulator): r for r in result.levels}
    assert levels["fixed", "interpreter"].n_total == 500
    assert levels["c", "gcc"].n_total == 500
    rtl = levels["rtl", "verilator"]
    assert (rtl.n_total, rtl.n_mismatch) == (500, 0)
    assert rtl.cycles_min == rtl.cycles_max == rtl.cycles_predicted
    (attitude,) = (d for d in result.accuracy.differences if d.output == "attitude")
    assert attitude.largest < 1e-4
    assert result.accuracy.saturated_updates == 0
    assert all(0.0 < level.seconds < 600.0 for level in result.levels)


def faulty(name, pattern, change, config="small"):
    """A build whose core's Verilog has a fault."""

    class Faulty(Core):
        def verilog(self, *, instances):
            out, count = re.subn(pattern, change, super().verilog(instances=instances))
            assert count, "the fault must be there"
            return out

    build = Build(estimator(name), config=config)
    core = build.core
    build.core = Faulty(core.parts, core.machine, core.image)
    return build


def test_a_wrong_table_word_is_found_by_output_and_step(log):
    build = faulty(
        "complementary",
        r"(tables0\[(?:5\d\d|[6-9]\d\d)\] = 32'd)(\d+);",
        lambda m: f"{m[1]}{int(m[2]) ^ 64};",
        config="fast",
    )
    (result,) = checked(log, 30, build=build, simulator="verilator")
    assert not result.good
    rtl = result.levels[-1]
    assert rtl.n_mismatch > 0
    assert re.fullmatch(
        rf"rtl: first difference in \w+, step {rtl.first_wrong}: wanted -?\d+, found -?\d+",
        rtl.divergence,
    )


def test_a_hanging_core_fails(log):
    # A program that never asks for input.
    build = faulty("complementary", r"(    rom0\[\d+\] = 54'[dh])[0-9a-f]+;", r"\g<1>0;")
    (result,) = checked(log, 3, build=build, simulator="verilator", levels=("rtl",))
    assert not result.good
    assert result.levels[0].error


def wrong_c(monkeypatch, change):
    """Let the C go wrong: ``change(outputs, saturated, states)`` in place."""
    whole = CModel.trajectory

    def trajectory(self, inputs):
        outcome = whole(self, inputs)
        change(*outcome)
        return outcome

    monkeypatch.setattr(CModel, "trajectory", trajectory)


def test_a_wrong_c_model_is_found(log, monkeypatch):
    def change(outputs, saturated, states):
        outputs[7, 0] ^= 1

    wrong_c(monkeypatch, change)
    (result,) = checked(log, 20, levels=("c",))
    assert not result.good
    assert (result.levels[0].n_mismatch, result.levels[0].first_wrong) == (1, 7)
    assert result.levels[0].divergence.startswith("c: first difference in pitch, step 7: wanted ")


def test_a_c_model_wrong_in_its_flag_alone_fails(log, monkeypatch):
    def change(outputs, saturated, states):
        saturated[5] ^= True

    wrong_c(monkeypatch, change)
    (result,) = checked(log, 20, levels=("c",))
    assert (result.levels[0].n_mismatch, result.levels[0].first_wrong) == (1, 5)
    assert result.levels[0].divergence == (
        "c: first difference in its saturation flag, step 5: wanted 0, found 1"
    )


@pytest.mark.parametrize("levels", [("fixed",), ("c",), ()])
def test_segments_must_join(log, monkeypatch, levels):
    """Whatever was asked for: what has no sound judge proves nothing."""

    def change(outputs, saturated, states):
        states[7, -1] ^= 1  # the last step of the first of twelve segments

    wrong_c(monkeypatch, change)
    (result,) = checked(log, 96, levels=levels)
    assert not result.good and not result.levels[0].good
    assert result.levels[0].level == "fixed"
    assert result.levels[0].error == "states differ from C after step 7"
    if "c" in levels:
        assert result.levels[1].first_wrong == 7


def test_missing_simulator_fails(log, monkeypatch):
    monkeypatch.setattr(
        "boresight.sim.rtl.simulators._missing", lambda name: f"{name} not found: install it"
    )
    results = checked(log, 3, *PAIR, simulator="icarus", levels=("rtl",))
    for result in results:
        assert not result.good
        assert result.levels[0].error == "icarus not found: install it"
        assert (result.levels[0].n_total, result.levels[0].n_mismatch) == (None, None)
    assert len(results) == 2
    assert verdict(results) == "FAILED: rtl in icarus: icarus not found: install it"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"levels": ("rtl", "silicon")}, r"^levels: wanted one of .*, found 'silicon'; .*$"),
        ({"levels": ("numpy",)}, r"^levels: wanted .* rtl, found 'numpy'; .*$"),
        ({"simulator": "modelsim"}, r"^simulator: wanted one of .*, found 'modelsim'; .*$"),
    ],
)
def test_bad_options_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        Check(Build(estimator("complementary")), **options)


# -- several estimators ---------------------------------------------------------------------------


class Gain(Estimator):
    """Two words in, one out; a state."""

    inputs = (Input("z", -1.0, 1.0), Input("k", -1.0, 1.0))
    states = (State("y", -4.0, 4.0),)
    outputs = (Output("y", tolerance=1e-6),)

    def step(self, x, u, p):
        """A leaky sum."""
        y = 0.5 * x.y + u.k * u.z
        return {"y": y}, {"y": y}


class Count(Estimator):
    """One word in, three out."""

    inputs = (Input("z", -1.0, 1.0),)
    states = (State("n", 0.0, 8.0),)
    outputs = (Output("n"), Output("square"), Output("z"))

    def step(self, x, u, p):
        """Half of what it had, and one."""
        n = 0.5 * x.n + 1.0
        return {"n": n}, {"n": n, "square": u.z * u.z, "z": 0.25 * u.z}


def test_records_of_any_lengths_take_turns(monkeypatch):
    """Words in and out, and how many records: what runs out stops. One build, many logs, of more
    than one block."""
    checking = Check(Build(Gain(), Count()), simulator="verilator")
    rng = np.random.default_rng(3)
    for n, m, kept in ((150, 90, 1000), (1, 120, 64), (130, 60, 64)):
        monkeypatch.setattr("boresight.sim.compare.check.KEPT", kept)
        first = Record.of({"z": rng.uniform(-1, 1, n), "k": rng.uniform(-1, 1, n)})
        second = Record.of({"z": rng.uniform(-1, 1, m)})
        results = checking.run(first, second)
        assert [r.levels[-1].n_total for r in results] == [n, m]
        assert all(r.good for r in results), [r.lines() for r in results]
        assert [r.estimator for r in results] == ["gain", "count"]
        told = "no output has a tolerance, so that rounding is not judged; "
        assert [told in str(r) for r in results] == [False, True]
        shapes = [(min(n, kept), 1), (min(m, kept), 3)]
        assert [r.fixed.words.shape for r in results] == shapes
        for number, result in enumerate(results):
            assert [x.level for x in result.levels] == ["fixed", "c", "rtl"]
            rtl, schedule = result.levels[-1], checking.build.core.select(number).schedule
            assert rtl.cycles_predicted == schedule.latency
            assert rtl.interval_predicted == schedule.interval


def test_parameters_are_of_their_estimator(log):
    values = {"kp_roll_per_s": 4.0, "declination_ht": 0.1}
    moved = Build(*(estimator_of(n) for n in PAIR), params=[None, values])
    results = checked(log, 30, build=moved, levels=("fixed", "c"))
    plain = checked(log, 30, *PAIR, levels=("fixed", "c"))
    assert all(r.good for r in results)
    assert (results[0].fixed.words == plain[0].fixed.words).all()
    assert not (results[1].fixed.words == plain[1].fixed.words).all()


class Constants(Estimator):
    """More constants than the registers of `small` hold, and little else."""

    inputs = tuple(Input(f"u{k}", -1.0, 1.0) for k in range(20))
    outputs = tuple(Output(f"y{k}", tolerance=1e-3) for k in range(13))

    def step(self, x, u, p):
        """A matrix times the inputs."""
        last = [getattr(u, i.name) for i in self.inputs]
        return {}, {
            y.name: sum((20 * row + k + 0.3) / 6000.0 * value for k, value in enumerate(last))
            for row, y in enumerate(self.outputs)
        }


class Delay(Estimator):
    """More states than `small` has slots for, and little else."""

    inputs = (Input("u", -1.0, 1.0),)
    states = tuple(State(f"s{k}", -1.0, 1.0) for k in range(129))
    outputs = (Output("y", tolerance=1e-3),)

    def step(self, x, u, p):
        """The last inputs."""
        last = [u.u, *(getattr(x, s.name) for s in self.states)]
        return {s.name: value for s, value in zip(self.states, last, strict=False)}, {"y": last[-1]}


@pytest.mark.parametrize("kind", [Constants, Delay])
def test_what_no_core_holds_is_said_without_rtl(kind):
    log = Record.of({i.name: np.linspace(-1.0, 1.0, 9) for i in kind.inputs})
    for config, small in (("small", True), ("small-1024", False)):
        (result,) = Check(Build(kind(), config=config), levels=("fixed",)).run(log)
        assert result.good
        assert [w.partition(": ")[0] for w in result.given.warnings] == [
            "no core, as compile would make it"
        ] * small


@pytest.mark.parametrize(("name", "share"), [("ma2014_cf", "33%"), ("mekf", "")])
def test_an_attitude_that_leaves_its_rates_is_told(name: str, share: str) -> None:
    """Its angles go past the vertical, where Euler angles end."""
    (result,) = Check(Build(estimator(name)), levels=("c",)).run(Log.of(bundled("ximu_walk")))
    told = [text for text in result.given.warnings if "away from gx gy gz" in text]
    assert result.good and len(told) == bool(share) and share in "".join(told)
