"""What `check` says of a model: errors against truth, faults, the floor of the process noise."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boresight
from boresight.kalman import Kalman, Measurement, State
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output
from boresight.sim.compare import textbook
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import CheckResult
from boresight.sim.levels.build import Build
from boresight.sim.records.record import Record
from boresight.sim.worlds.world import World

N = 200
DT = 0.01
T = DT * np.arange(N)


def checked(estimator: Estimator, **columns: Any) -> CheckResult:
    (result,) = Check(Build(estimator), levels=("c",)).run(Record.of(columns))
    return result


class Scale(Estimator):
    """Twice its input; its error against truth is limited."""

    inputs = (Input("u", -4.0, 4.0, "V"),)
    outputs = (Output("y", "V", tolerance=1e-6, truth=0.2),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"y": 2.0 * u.u}


@pytest.mark.parametrize(("off", "good"), [(0.1, True), (-0.3, False)])
def test_the_error_against_truth_is_shown_and_judged(off: float, good: bool) -> None:
    u = np.sin(T)
    result = checked(Scale(), u=u, y_true=2.0 * u + off)
    (error,) = result.truth
    assert error.rms == pytest.approx(abs(off)) and result.good == good
    said = f"against truth: y            rms {abs(off):g} V, max {abs(off):g} V: "
    assert said + ("within 0.2" if good else "BEYOND 0.2") in str(result)
    assert result.to_json()["truth"][0]["rms"] == error.rms
    gaps = np.where(np.arange(N) < 5, 2.0 * u, np.nan)
    assert checked(Scale(), u=u, y_true=gaps).truth[0].samples == 5
    counts = np.arange(N) % 2 == 0
    assert checked(Scale(), u=u, y_true=2.0 * u, mov=counts).truth[0].samples == N // 2
    assert checked(Scale(), u=u).truth == ()


def test_a_limit_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="wanted a limit above 0 for the error against truth"):
        Output("y", truth=0.0)


class Track(Kalman):
    """Position and velocity from positions at 100 Hz, which are held in between."""

    inputs = (Input("z", -10.0, 10.0, "m", missing="hold"), Input("z_new", 0.0, 1.0, valid_of="z"))
    states = (
        State("pos", -16.0, 16.0, "m", sd=1.0, sd_max=4.0),
        State("vel", -16.0, 16.0, "m/s", sd=1.0, sd_max=4.0),
    )
    outputs = (Output("pos", "m", tolerance=1e-3),)
    dt, gate, flagged, q = DT, 5.0, True, 1e-3

    def f(self, x: Any, u: Any, p: Any) -> Any:
        return {"pos": x.pos + self.dt * x.vel}

    def noise(self, x: Any, u: Any, p: Any) -> Any:
        return {"vel": self.q} if self.q else {}

    def measure(self, x: Any, u: Any, p: Any) -> Any:
        valid = u.z_new > 0.5 if self.flagged else None
        return [Measurement(u.z, x.pos, 0.01, valid=valid, gate=self.gate)]


def tracked(kind: type[Track] = Track, each: int = 4, **changes: Any) -> CheckResult:
    z, y = (np.where(np.arange(N) % rows == 0, 1.0 + np.sin(T), np.nan) for rows in (4, each))
    return checked(type("Track", (kind,), changes)(), t=T, z=z, y=y)


def damped(self: Any, x: Any, u: Any, p: Any) -> Any:
    """Exact over a time step of DT: a speed that decays by half."""
    return {"pos": x.pos + DT * 0.5 / np.log(2.0) * x.vel, "vel": 0.5 * x.vel}


class Wheels(Track):
    """The position moves with the mean of two speeds."""

    states = (*Track.states, State("right", -16.0, 16.0, "m/s", sd=1.0, sd_max=4.0))

    def f(self, x: Any, u: Any, p: Any) -> Any:
        return {"pos": x.pos + 0.5 * self.dt * (x.vel + x.right)}

    def noise(self, x: Any, u: Any, p: Any) -> Any:
        return {"pos": 1e-4, "vel": self.q, "right": self.q}

    def measure(self, x: Any, u: Any, p: Any) -> Any:
        return [*super().measure(x, u, p), Measurement(0.0, x.vel - x.right, 0.1)]


def by_one_flag(self: Any, x: Any, u: Any, p: Any) -> Any:
    return [Measurement(v, x.pos, 0.01, valid=u.z_new > 0.5) for v in (u.z, u.y)]


#: Of two values in one message.
MESSAGE = {"inputs": (*Track.inputs, Input("y", -10.0, 10.0, "m", missing="hold"))}
MESSAGE |= {"measure": by_one_flag}


@pytest.mark.parametrize(
    ("kind", "changes"), [(Track, {}), (Track, {"f": damped}), (Wheels, {}), (Track, MESSAGE)]
)
def test_a_sound_model_has_no_fault(kind: type[Track], changes: dict[str, Any]) -> None:
    result = tracked(kind, **changes)
    assert result.good and result.book.faults == () and result.given.warnings == ()


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_a_coarse_sensor_is_not_held(noise: float) -> None:
    """It repeats three in four values, with a sample in every row."""
    z = np.sin(T) + np.random.default_rng(2).normal(0.0, noise, N)
    kind = type("Track", (Track,), {"flagged": False, "inputs": Track.inputs[:1]})
    result = checked(kind(), t=T, z=np.round(z))
    assert np.mean(np.diff(np.round(z)) == 0.0) > 0.6
    assert result.book.faults == ()


@pytest.mark.parametrize(("rows", "each"), [(40, 10), (100, 20), (200, 4)])
def test_a_short_log_of_a_held_sensor_fails(rows: int, each: int) -> None:
    """Three new samples tell, unless they rise evenly, as a slow command does."""
    kind = type("Track", (Track,), {"flagged": False, "inputs": Track.inputs[:1]})
    number = np.arange(rows) // each
    for z, n_faults in ((np.sin(1.3 * number), 1), (0.05 * number, 0)):
        assert len(checked(kind(), t=T[:rows], z=z).book.faults) == n_faults


@pytest.mark.parametrize(
    ("kind", "changes", "said"),
    [
        ("gate", {"gate": 1e-6}, "within the gate of 1e-06 standard deviations, found none in 50"),
        ("hold", {"flagged": False}, "taken in 150 of 200 updates without a new sample of z"),
        (
            "hold",
            {"flagged": False, "inputs": Track.inputs[:1]},
            "z holds its last sample in 75% of the updates",
        ),
        ("hold", MESSAGE | {"each": 20}, "y holds its last sample in 82% of the updates that take"),
        ("time step", {"dt": 2.0 * DT}, "by a time step of 0.02 s, the records have one of 0.01 s"),
        (
            "time step",
            {
                "dt": 2.0 * DT / 3.6,
                "states": (Track.states[0], State("vel", -60.0, 60.0, "km/h", sd=3.0, sd_max=12.0)),
                "q": 1e-2,
            },
            "by a time step of 0.02 s, the records have one of 0.01 s",
        ),
    ],
)
def test_a_fault_of_the_model_fails_unless_it_is_waived(
    kind: str, changes: dict[str, Any], said: str
) -> None:
    result = tracked(**changes)
    (text,) = result.book.faults
    assert said in text and not result.good and text in result.failures
    waived = tracked(**changes, waived=(kind,))
    assert waived.good and said in waived.given.warnings[-1]


@pytest.mark.parametrize("known", [{}, {"pos_true": np.full(N, np.nan)}, {"pos_true": np.sin(T)}])
def test_a_limit_for_which_the_log_has_no_truth_is_told(known: dict[str, Any]) -> None:
    outputs = (Output("pos", "m", tolerance=1e-3, truth=0.5),)
    result = checked(type("Track", (Track,), {"outputs": outputs})(), t=T, z=np.sin(T), **known)
    text = "pos: truth=0.5 is not judged: no true value of it is given, pos_true"
    without = not np.isfinite(known.get("pos_true", np.nan)).any()
    assert (text in result.given.warnings) == without and result.good


@pytest.mark.parametrize("times", [{"t": T}, {"dt": np.full(N, DT)}, {"fs": 1.0 / DT}])
@pytest.mark.parametrize(("dt", "notes"), [(DT, 0), (2.0 * DT, 1)])
def test_a_wrong_time_step_is_told_from_each_source_of_times(
    tmp_path: Path, dt: float, notes: int, times: dict[str, Any]
) -> None:
    estimator = type("Track", (Track,), {"dt": dt})()
    log = tmp_path / "log.npz"
    np.savez(log, **times, z=np.sin(T), pos_true=np.sin(T))
    (checked_log,) = Check(Build(estimator), levels=("c",)).run(log)
    faults = [*checked_log.book.faults]
    assert len(faults) == notes
    result = boresight.run(estimator, log)
    assert result.good and result.notes == faults
    assert [*boresight.accuracy(estimator, log).notes] == [f"log: {text}" for text in faults]

    class Wave(World):
        def pieces(self) -> Any:
            yield {**times, "z": np.sin(T)}

    if "dt" in times:
        assert [*boresight.run(estimator, Wave()).notes] == faults
        (checked_world,) = boresight.check(estimator, Wave(), levels=("c",))["results"]
        assert [*checked_world.book.faults] == faults


@pytest.mark.parametrize(("scale", "told"), [(1.0, False), (-1.0, True), (0.1, True)])
def test_errors_beyond_what_the_filter_says_of_itself_are_told(scale: float, told: bool) -> None:
    z = 2.0 + np.sin(T) + np.random.default_rng(5).normal(0.0, 0.1, N)
    kind = type("Track", (Track,), {"q": 1e-4})
    result = checked(kind(), t=T, z=z, pos_true=scale * (2.0 + np.sin(T)))
    assert result.good
    text = r"warning: pos: its error against pos_true is typically \d+ times its own standard dev"
    assert bool(re.search(text, str(result))) == told


def test_the_truth_of_an_output_that_is_not_the_estimate_is_not_compared_with_it() -> None:
    """In another unit; before the correction."""

    class Centimetres(Track):
        outputs = (Output("pos", "cm", tolerance=0.1),)

        def shown(self, x: Any, u: Any, p: Any) -> Any:
            return {"pos": 100.0 * x.pos}

    class Predicted(Track):
        prior, flagged = True, False

        def noise(self, x: Any, u: Any, p: Any) -> Any:
            return {"pos": 1e-2, "vel": 1e-2}

        def measure(self, x: Any, u: Any, p: Any) -> Any:
            return [Measurement(u.z, x.pos, 1e-6)]

    rng = np.random.default_rng(5)
    walk = np.cumsum(rng.normal(0.0, 0.1, N))
    z = walk + rng.normal(0.0, 1e-3, N)
    for kind, true in ((Centimetres, 100.0 * walk), (Predicted, walk)):
        assert "pos_true" not in str(checked(kind(), t=T, z=z, pos_true=true))


def test_an_error_covariance_that_cannot_be_used_is_refused() -> None:
    class Wrong(Track):
        def error_covariance(self, states: Any, params: Any) -> Any:
            return ("pos",), states["p_pos_pos"]

    message = r"error_covariance: wanted names of states, .*, found the shape \(200,\) of 1 names"
    with pytest.raises(InputError, match=message):
        checked(Wrong(), t=T, z=np.sin(T), pos_true=np.sin(T))


def test_an_unknown_kind_of_fault_is_refused() -> None:
    with pytest.raises(InputError, match="waived: wanted one of gate, hold, time step"):
        tracked(waived=("gates",))


def test_a_floor_beside_the_noise_is_told_and_the_textbook_has_none() -> None:
    result = tracked(q=1e-8, floor=2.0**-22)
    assert any(
        re.search(
            r"vel gets .* its process noise of 1e-08; raise it to \S+, or lower floor to 2", w
        )
        for w in result.given.warnings
    )
    (pos,) = result.textbook
    assert pos.largest > 1e-3 and result.book.by_floor and result.good
    assert "BEYOND the tolerance of pos, which floor explains; this fails no check" in str(result)


def test_no_process_noise_at_all_is_told() -> None:
    assert "track: no state has process noise" in str(tracked(q=0.0))


@pytest.mark.parametrize(("sd", "told"), [(0.1, False), (1.0, True)])
def test_a_gate_that_rejects_most_is_told(sd: float, told: bool) -> None:
    z = np.random.default_rng(3).normal(0.0, sd, N)
    result = checked(type("Track", (Track,), {"gate": 2.0})(), t=T, z=z)
    text = r"the gate of 2 standard deviations rejects (\d+) of 200 measurements; raise r, "
    found = re.search(text, str(result))
    assert bool(found) == told and result.good
    assert not found or f"{200 - int(found[1])} accepted, {found[1]} rejected" in str(result)


@pytest.mark.parametrize(
    ("first", "last", "said"),
    [
        (0, 600, None),
        (0, 50, "found 50 in 600 updates"),
        (0, 520, "found none in the last 80 of 600 updates"),
        (20, 60, "found 40 in 600 updates"),
    ],
)
def test_a_gate_that_loses_what_it_measures_fails(
    first: int, last: int, said: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Outside some updates the sensor is off by 90 m: also after those of the textbook's form."""
    monkeypatch.setattr(textbook, "_MOST", 400)
    rows = np.arange(600)
    z = np.where((rows >= first) & (rows < last), 0.0, 90.0)

    class Still(Track):
        inputs, flagged, gate = (Input("z", -100.0, 100.0, "m"),), False, 5.0

        def f(self, x: Any, u: Any, p: Any) -> Any:
            return {"pos": x.pos}

    for waived in ((), ("gate",)) if said else ((),):
        kind = type("Still", (Still,), {"waived": waived})
        result = checked(kind(), t=DT * rows, z=z)
        assert result.good == (said is None or waived == ("gate",)), str(result)
        texts = result.given.warnings if waived else result.book.faults
        assert [said in text for text in texts if "within the gate" in text] == [True] * bool(said)
        assert f"{last - first} accepted, {600 - last + first} rejected" in str(result)


def test_a_gate_that_decides_otherwise_than_in_float64_is_to_blame_and_may_be_accepted() -> None:
    t = DT * np.arange(600)
    columns = {"t": t, "z": np.sin(t) + np.random.default_rng(4).normal(0.0, 0.3, len(t))}

    class Near(Track):
        inputs, flagged, gate = (Input("z", -100.0, 100.0, "m"),), False, 3.0
        states = (
            State("pos", -100.0, 100.0, "m", sd=1.0, sd_max=1.5),
            State("vel", -100.0, 100.0, "m/s", sd=1.0, sd_max=1.5),
        )
        outputs = (Output("pos", "m", tolerance=2e-2),)

        def noise(self, x: Any, u: Any, p: Any) -> Any:
            return {"pos": 1e-8, "vel": 1e-4}

        def measure(self, x: Any, u: Any, p: Any) -> Any:
            return [Measurement(u.z, x.pos, 0.09, gate=self.gate)]

    def near(**changes: Any) -> CheckResult:
        kind = type("Near", (Near,), changes)
        return boresight.check(kind, columns, levels=("c",), word=20)["results"][0]

    for name, others in (("rejected", ()), ("accepted", (Output("accepted", "bits"),))):
        culprit = near(outputs=(*Near.outputs, *others)).accuracy.culprit
        said = r"step \d+, a gate \(test_model\.py, line \d+\) decides otherwise than in float64, "
        said += r"as in \d+ of 600 updates: .*; use a wider word, or .*, by "
        said += rf'Output\("{name}", "bits", share=(\S+)\)'
        found = re.fullmatch(said, culprit)
        assert found, culprit
        assert near(outputs=(*Near.outputs, Output(name, "bits", share=float(found[1])))).good
