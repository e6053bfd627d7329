"""Filters that are derived from their model: what is derived, and what is refused."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import boresight
from boresight import Estimator, Input, InputError, Output, Param, ops
from boresight.kalman import Attitude, Kalman, Measurement, State, Textbook, vector
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import CompiledFloat, make_level

DT = 0.02


class Cart(Kalman):
    """Position and velocity of a cart from noisy positions."""

    inputs = (Input("z", -100.0, 100.0, "m"), Input("there", 0.0, 1.0))
    params = (Param("r", 0.25, 0.01, 4.0, "m^2"), Param("q", 0.5, 0.001, 8.0, "m^2/s^3"))
    states = (
        State("pos", -128.0, 128.0, "m", sd=2.0),
        State("vel", -64.0, 64.0, "m/s", sd=2.0, sd_max=8.0),
    )
    outputs = (Output("pos", "m", 1e-4), Output("vel", "m/s", 1e-4), Output("nis"))
    gate: float | None = None

    def f(self, x: Any, u: Any, p: Any) -> Any:
        return {"pos": x.pos + DT * x.vel}

    def noise(self, x: Any, u: Any, p: Any) -> Any:
        return {"vel": DT * p.q, ("pos", "vel"): 0.25 * DT * DT * p.q, "pos": 0.1 * DT**3 * p.q}

    def measure(self, x: Any, u: Any, p: Any) -> Any:
        return [Measurement(u.z, x.pos, p.r, valid=u.there > 0.5, gate=self.gate)]


class Gated(Cart):
    gate = 2.0


class Turning(Kalman):
    """An angle that wraps, its rate, and a value that is kept beside them."""

    inputs = (Input("s", -1.5, 1.5), Input("c", -1.5, 1.5), Input("angle", -1.0, 1.0, "ht"))
    params = (Param("r", 0.01, 1e-3, 1.0),)
    states = (
        State("heading", -1.0, 1.0, "ht", sd=0.3),
        State("rate", -8.0, 8.0, "ht/s", initial=2.0, sd=1.0),
        State("scale", 0.5, 1.5, initial=1.0, sd=0.1),
    )
    memory = (boresight.State("updates", 0.0, 1024.0),)
    outputs = (Output("heading", "ht"), Output("rate", "ht/s"), Output("count"))

    def f(self, x: Any, u: Any, p: Any) -> Any:
        return {
            "heading": ops.wrap_ht(x.heading + DT * x.rate),
            "updates": ops.minimum(x.updates + 1.0, 1000.0),
        }

    def noise(self, x: Any, u: Any, p: Any) -> Any:
        return {"rate": 1e-3, "heading": 1e-6}

    def measure(self, x: Any, u: Any, p: Any) -> Any:
        sine, cosine = ops.sincos_ht(x.heading)
        return [
            Measurement(u.s, x.scale * sine, p.r),
            Measurement(u.c - x.scale * cosine, 0.0, p.r),
            Measurement(u.angle, x.heading, 0.01 * p.r, wrap=True),
        ]

    def shown(self, x: Any, u: Any, p: Any) -> Any:
        return {"count": x.updates}


def turning(n: int) -> np.ndarray:
    rng, angle = np.random.default_rng(2), 0.04 * np.arange(1, n + 1) + 0.1
    noisy = angle + rng.normal(0.0, 0.01, n)
    seen = np.stack([1.1 * np.sin(np.pi * angle), 1.1 * np.cos(np.pi * angle)], axis=1)
    seen += rng.normal(0.0, 0.1, seen.shape)
    return np.column_stack([np.clip(seen, -1.5, 1.5), (noisy + 1.0) % 2.0 - 1.0])


def cart(n: int) -> np.ndarray:
    rng, t = np.random.default_rng(1), DT * np.arange(n)
    z = 20.0 * np.sin(0.2 * t) + rng.normal(0.0, 0.5, n)
    z[rng.random(n) < 0.05] += 8.0
    return np.column_stack([z, rng.random(n) < 0.8])


def floating(filter: Kalman, inputs: np.ndarray) -> dict[str, np.ndarray]:
    return CompiledFloat(Build(filter)).run(inputs).outputs


def far(filter: Kalman, inputs: np.ndarray) -> float:
    """Largest difference from the textbook, as a share of the largest value."""
    book, outcome = Textbook(filter, floor=True).run(inputs).outputs, floating(filter, inputs)
    angles = {o.name for o in filter.outputs if o.unit == "ht"}
    shares = []
    for name, values in book.items():
        deviation = outcome[name] - values
        deviation = (deviation + 1.0) % 2.0 - 1.0 if name in angles else deviation
        shares.append(np.abs(deviation).max() / np.abs(values).max())
    return float(max(shares))


@pytest.mark.parametrize("filter", [Cart, Gated, Turning])
def test_float64_is_the_textbook(filter: type[Kalman]) -> None:
    inputs = turning(400) if filter is Turning else cart(400)
    assert far(filter(), inputs) < 1e-9


def test_the_textbook_is_that_of_matrices() -> None:
    """Without any of our code: F, H, Q and R by hand."""
    filter, inputs = Cart(), cart(300)
    x, p = np.zeros(2), np.diag([4.0, 4.0])
    f, h, r, q = np.array([[1.0, DT], [0.0, 1.0]]), np.array([[1.0, 0.0]]), 0.25, 0.5
    noise = q * np.array([[0.1 * DT**3, 0.25 * DT**2], [0.25 * DT**2, DT]])
    noise += 2.0 * 2.0**-31 * np.diag([2.4**2, 8.0**2])
    run = Textbook(filter, floor=True).run(inputs)
    for k, (z, there) in enumerate(inputs):
        x, p = f @ x, f @ p @ f.T + noise
        if there:
            gain = p @ h.T / (h @ p @ h.T + r)
            x, p = x + gain[:, 0] * (z - x[0]), (np.eye(2) - gain @ h) @ p
        results = [run.outputs["pos"][k], run.outputs["vel"][k]]
        assert np.allclose(results, x, rtol=1e-6) and np.allclose(run.covariances[k], p, rtol=1e-4)


def test_a_gate_leaves_out_what_lies_beyond() -> None:
    inputs = cart(400)
    every, gated = (floating(f, inputs) for f in (Cart(), Gated()))
    assert np.abs(every["pos"] - gated["pos"]).max() > 0.1
    assert gated["nis"].max() <= 4.0 < every["nis"].max()


@pytest.mark.parametrize("filter", [Cart, Gated, Turning])
def test_fixed_point_and_c_are_equal_and_near(filter: type[Kalman], tmp_path: Any) -> None:
    inputs = turning(300) if filter is Turning else cart(300)
    columns = {i.name: inputs[:, k] for k, i in enumerate(filter.inputs)}
    (result,) = boresight.check(filter, columns, levels=("fixed", "c"))["results"]
    assert result.exact and not result.accuracy.saturated_updates
    assert all(d.largest < 1e-4 for d in result.accuracy.differences), result.lines()
    assert result.textbook and "textbook" in str(result)


def test_a_variance_is_held_near_its_largest() -> None:
    """Nothing is measured: P stays below what was declared, and positive."""
    inputs = np.zeros((1000, 2))
    filter = Cart()
    cov = Textbook(filter, floor=True).run(inputs).covariances
    assert (cov[:, [0, 1], [0, 1]] <= np.array([2.4**2, 8.0**2])).all()
    assert np.linalg.eigvalsh(cov).min() > 0.0 and cov[-1, 0, 0] > 0.7 * 2.4**2
    columns = {"z": inputs[:, 0], "there": inputs[:, 1]}
    (result,) = boresight.check(Cart, columns, levels=("fixed",))["results"]
    assert result.good


class Slow(Kalman):
    """Noise of three tenths of a last bit, or what the rate has in common with the position."""

    inputs, dither = (Input("z", -1.0, 1.0),), True
    states = (State("pos", -1.0, 1.0, sd=0.5, sd_max=1.0), State("rate", -1.0, 1.0, sd=0.5))
    floor = 0.0

    def f(self, x: Any, u: Any, p: Any) -> Any:
        return {"pos": x.pos + 1.2 * 2.0**-31 * x.rate}

    def noise(self, x: Any, u: Any, p: Any) -> Any:
        return {"rate": 0.3 * 2.0**-32}

    def measure(self, x: Any, u: Any, p: Any) -> Any:
        return [Measurement(u.z, x.pos, 1.0, valid=u.z > 0.5)]


def test_what_is_less_than_a_last_bit_counts_on_average_where_rounding_is_random() -> None:
    """0.3 last bits in each of 4,000 updates: 1,200, but none where they are rounded."""

    class Rounded(Slow):
        dither = False

    zeros = np.zeros((4000, 1))
    for kalman, steps in ((Slow(), 4000), (Rounded(), 0)):
        level = make_level("c", Build(kalman))
        states = level.run(zeros).states
        assert states is not None
        names = [s.name for s in kalman.states]
        for element in ("p_rate_rate", "p_pos_rate"):
            words = states[:, names.index(element)]
            grown = words[-1] - words[0]
            assert abs(grown - 0.3 * steps) <= (150 if steps else 0), (element, grown)
    given = np.random.default_rng(1).uniform(-1.0, 1.0, (50, 1))
    first, second = (CompiledFloat(Build(k)).run(given).outputs for k in (Slow(), Rounded()))
    assert all(np.array_equal(first[name], second[name]) for name in ("pos", "rate"))


def test_the_covariance_of_outputs_is_that_part_of_p() -> None:
    """For the consistency of Monte-Carlo runs (NEES)."""
    filter = Turning()
    draw = np.random.default_rng(6)
    states = {s.name: draw.random(4) for s in filter.states}
    names, p = filter.error_covariance(states, {}) or ((), np.zeros(0))
    assert names == ("heading", "rate") and p.shape == (4, 2, 2)
    assert (p[:, 0, 1] == p[:, 1, 0]).all() and (p[:, 0, 1] == states["p_heading_rate"]).all()
    assert (p[:, 1, 1] == states["p_rate_rate"]).all()


def test_outputs_may_be_those_of_the_prediction() -> None:
    class Early(Cart):
        prior = True
        outputs = (Output("pos", "m", 1e-4), Output("nis"))

    inputs = cart(100)
    late, ahead = floating(Cart(), inputs), floating(Early(), inputs)
    assert np.allclose(ahead["pos"][1:], late["pos"][:-1] + DT * late["vel"][:-1])
    assert late["nis"].max() > 0.1 and np.allclose(ahead["nis"], late["nis"])
    early, usual = (Build(f()).core.parts[0].schedule.latencies[0] for f in (Early, Cart))
    assert early < 20 < usual and far(Early(), inputs) < 1e-9


def test_a_state_may_start_at_its_largest_deviation() -> None:
    class Still(Kalman):
        inputs = (Input("z", -8.0, 8.0),)
        states = (State("x", -8.0, 8.0, sd=0.5, sd_max=0.5),)

        def measure(self, x: Any, u: Any, p: Any) -> Any:
            return [Measurement(u.z, x.x, 0.1)]

    assert Still().states[1].initial == pytest.approx(0.25, rel=1e-4)


def test_a_claim_of_what_the_states_leave_unknown() -> None:
    """Words of h P h + r are as fine as it allows; the record is the same."""

    class Steep(Cart):
        claim: float | None = None

        def measure(self, x: Any, u: Any, p: Any) -> Any:
            h = x.pos + 0.1 * (x.vel * x.vel)
            return [Measurement(u.z, h, p.r, sd_max=self.claim)]

    class Claimed(Steep):
        claim = 4.0

    def variance(kind: type[Kalman]) -> float:
        return max(e.data[1] for e in kind().record().needed if "h P h + r" in e.data)

    assert variance(Claimed) == pytest.approx(16.0 + 4.0) and variance(Steep) > 100.0
    log = {"z": np.zeros(50), "there": np.ones(50)}
    for claim, good in ((4.0, True), (1.0, False)):  # P of pos begins at 4
        Claimed.claim = claim
        (result,) = boresight.check(Claimed(), log, levels=("fixed",))["results"]
        said = "\n".join(result.lines())
        assert ("raise sd_max of this Measurement" in said) is not good, said


class Compass(Estimator):
    """A heading in degrees, in the range of one turn."""

    inputs = (Input("s", -1.0, 1.0),)
    states = (
        boresight.State("heading", -2.0, 2.0, "deg"),
        boresight.State("rate", -180.0, 180.0, "deg"),
    )
    outputs = (Output("heading", "deg"), Output("rate", "deg"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        after = {"heading": u.s + 0.0, "rate": 90.0 * u.s}
        return after, after


@pytest.mark.parametrize(
    ("kind", "column", "said"),
    [
        (Turning, "heading_true", "-3 ht is beyond the range [-1, 1] of the state"),
        (Turning, "heading_true [rad]", ""),
        (Turning, "rate_true [deg/s]", "-9.55 ht/s is beyond the range [-8, 8] of"),
        (Compass, "heading_true [deg]", "[-2, 2] of the state heading; widen the state"),
        (Compass, "rate_true [deg]", "state rate; declare state and output in ht, which is "),
    ],
)
def test_a_true_value_that_a_state_cannot_have(
    kind: type[Estimator], column: str, said: str, tmp_path: Any
) -> None:
    true = (-3.0, 3.0) if "heading" in column else (-1719.0, 0.0)
    log = tmp_path / "log.csv"
    rows = [f"{0.1 * k:.1f},0,1,0,{true[k % 2]}" for k in range(20)]
    log.write_text("\n".join([f"t,s,c,angle,{column}", *rows]) + "\n")
    (result,) = boresight.check(kind(), log, levels=("fixed",))["results"]
    where = f"column {column.split()[0]}: "
    told = [text for text in result.to_json()["warnings"] if text.startswith(where)]
    assert len(told) == bool(said) and said in "".join(told)


def test_what_measurements_before_took_is_within_the_claim() -> None:
    """|h L| <= sd_max: the innovation's word holds 64 of them and not what intervals allow."""

    class Twice(Cart):
        def measure(self, x: Any, u: Any, p: Any) -> Any:
            h = x.pos + 0.1 * (x.vel * x.vel)
            return [Measurement(u.z, x.pos, p.r), Measurement(u.z, h, p.r, sd_max=4.0)]

    widest = [e.data[1] for e in Twice().record().needed if "standard deviations" in e.data]
    assert widest.count(4.0) == 1
    log = {"z": np.sin(0.02 * np.arange(500)), "there": np.ones(500)}
    (result,) = boresight.check(Twice(), log, levels=("fixed", "c"))["results"]
    assert result.good, result.lines()


def test_a_bearing_all_around_has_limited_derivatives() -> None:
    """Of a vector that may be zero, where intervals know no end."""

    class Around(Kalman):
        inputs = (Input("b", -1.0, 1.0, "ht"),)
        states = (State("mx", -16.0, 16.0, initial=4.0, sd=1.0), State("my", -16.0, 16.0, sd=1.0))
        outputs = (Output("mx", tolerance=1e-4), Output("my", tolerance=1e-4))
        steepest: Mapping[str, float] = {}

        def measure(self, x: Any, u: Any, p: Any) -> Any:
            b = np.arctan2(x.my, x.mx) / np.pi
            return [Measurement(u.b, b, 1e-3, slope_max=self.steepest)]

    class Limited(Around):
        steepest = {"mx": 0.5, "my": 0.5}

    with pytest.raises(InputError, match=r'256 m .* slope_max=\{"mx": 2\*\*-8, "my": 2\*\*-8\}'):
        Around().record()

    class Radians(Limited):
        inputs = (Input("b", -3.2, 3.2, "rad"),)

        def measure(self, x: Any, u: Any, p: Any) -> Any:
            return [Measurement(u.b, np.arctan2(x.my, x.mx), 1e-2, slope_max=self.steepest)]

    for made, turn in ((Limited(), 1.0), (Radians(), np.pi)):
        log = {"b": turn * (0.1 + 0.01 * np.sin(np.arange(200.0)))}
        (result,) = boresight.check(made, log, levels=("fixed", "c"))["results"]
        assert result.good, result.lines()


def test_a_derivative_counts_as_its_largest_beyond_it() -> None:
    """Of 0.2 v, limited to 1 at v = 8: as without a limit up to 5 m/s, and above as 1."""

    class Steep(Cart):
        steepest: Mapping[str, float] = {}

        def measure(self, x: Any, u: Any, p: Any) -> Any:
            h = x.pos + 0.1 * (x.vel * x.vel)
            return [Measurement(u.z, h, p.r, slope_max=self.steepest)]

    class Limited(Steep):
        steepest = {"vel": 1.0}

    def gain(kind: type[Kalman], rate: float) -> float:
        k = kind()
        given = {s.name: s.initial for s in k.states} | {"vel": rate, "p_pos_vel": 1.0}
        given |= {p.name: p.default for p in k.params}
        x = SimpleNamespace(**given | {"there": 1.0, "z": 4.0})
        after, _ = k.step(x, x, x)
        return float(after["pos"] - rate * DT)

    assert gain(Limited, 4.0) == gain(Steep, 4.0)
    assert gain(Limited, 8.0) != gain(Steep, 8.0)


def test_lines_are_the_authors() -> None:
    trace = Turning().record()
    lines = {e.line for e in trace.needed if e.args}
    assert lines and all(line.startswith("test_kalman.py, line ") for line in lines)


def test_vectors_by_name() -> None:
    class Drop(Kalman):
        inputs = vector(Input, "z", "enu", -100.0, 100.0, "m")
        states = (
            *vector(State, "p", "enu", -100.0, 100.0, "m", sd=1.0),
            *vector(State, "v", "enu", -50.0, 50.0, "m/s", sd=1.0),
        )

        def f(self, x: Any, u: Any, p: Any) -> Any:
            return {"p": x.p + DT * x.v, "v": x.v - DT * np.array([0.0, 0.0, 9.8])}

        def noise(self, x: Any, u: Any, p: Any) -> Any:
            return {"v": 1e-4, "p": [1e-6, 1e-6, 2e-6]}

        def measure(self, x: Any, u: Any, p: Any) -> Any:
            return [Measurement(z, h, 0.1) for z, h in zip(u.z, x.p, strict=True)]

    filter = Drop()
    assert [o.name for o in filter.outputs] == ["pe", "pn", "pu", "ve", "vn", "vu"]
    rng = np.random.default_rng(3)
    assert far(filter, rng.uniform(-2.0, 2.0, (60, 3))) < 1e-9


# -- what is refused ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "z", [lambda u: u.angle, lambda u: u.angle - 0.25, lambda u: ops.atan2_ht(u.s, u.c)]
)
def test_the_innovation_of_an_angle_wraps_by_its_unit(z: Any) -> None:
    class Unsaid(Turning):
        wrap = False

        def measure(self, x: Any, u: Any, p: Any) -> Any:
            return [Measurement(z(u), x.heading, 0.01 * p.r, wrap=self.wrap)]

    class Said(Unsaid):
        name = "unsaid"
        wrap = True

    assert Unsaid().compile().digest == Said().compile().digest
    seen = turning(60)
    assert far(Unsaid(), seen) < 1e-9  # float64 against the textbook


@pytest.mark.parametrize("turn", [np.pi, 180.0])
def test_an_arc_tangent_in_another_unit_is_converted_and_wraps(turn: float) -> None:
    class Bearing(Kalman):
        unit = turn  # of half a turn

        inputs = (Input("z", -1.05 * turn, 1.05 * turn, "rad" if turn < 4.0 else "deg"),)
        states = (
            State("east", -100.0, 100.0, "m", initial=2.0, sd=10.0, sd_max=20.0),
            State("south", 20.0, 100.0, "m", initial=50.0, sd=10.0, sd_max=20.0),
        )
        outputs = (Output("east", "m"), Output("south", "m"))

        def noise(self, x: Any, u: Any, p: Any) -> Any:
            return {"east": 1e-2, "south": 1e-2}

        def measure(self, x: Any, u: Any, p: Any) -> Any:
            angle = np.arctan2(x.east, -x.south)
            h = angle if self.unit < 4.0 else np.degrees(1.0) * angle
            return [Measurement(u.z, h, 1e-4 * self.unit**2, gate=8.0, sd_max=0.25 * self.unit)]

    class HalfTurns(Bearing):
        name = "bearing"
        unit = 1.0

        def measure(self, x: Any, u: Any, p: Any) -> Any:
            h = ops.atan2_ht(x.east, -x.south)
            return [Measurement(u.z * (1.0 / turn), h, 1e-4, wrap=True, gate=8.0, sd_max=0.25)]

    ahead = np.where(np.arange(80) % 2, 0.98, -0.98)  # beside the ends of the range
    outcome = floating(Bearing(), turn * ahead[:, None])
    wanted = floating(HalfTurns(), turn * ahead[:, None])
    assert np.ptp(outcome["east"]) > 0.1
    for name, values in wanted.items():
        assert outcome[name] == pytest.approx(values, abs=1e-6)
    assert far(Bearing(), turn * ahead[:, None]) < 1e-6
    formats = [[v.frac for v in e.compile().values] for e in (Bearing(), HalfTurns())]
    assert formats[0] == formats[1]  # sd_max is converted, too


def refused(make: Any) -> str:
    with pytest.raises(InputError) as error:
        make().compile()
    text = str(error.value)
    assert text.startswith("test_kalman.py, line ") and "\n" not in text
    return text


def changed(**members: Any) -> type[Kalman]:
    return type("Changed", (Cart,), members)


@pytest.mark.parametrize(
    ("members", "said"),
    [
        ({"states": (boresight.State("pos", -1.0, 1.0),)}, "a state with a standard deviation"),
        ({"states": ()}, "states to be estimated"),
        ({"f": lambda self, x, u, p: {"speed": x.vel}}, "next values of states: pos, vel"),
        ({"f": lambda self, x, u, p: None}, "f of changed: wanted a dictionary of next values"),
        ({"f": lambda self, x, u, p: {"pos": [x.pos, x.vel]}}, "wanted a number, found ["),
        ({"noise": lambda self, x, u, p: None}, "noise of changed: wanted a dictionary of noise"),
        ({"noise": lambda self, x, u, p: {"vel": "a"}}, "noise of changed, vel: wanted a number"),
        ({"noise": lambda self, x, u, p: {"speed": 1.0}}, "noise of states: pos, vel"),
        ({"shown": lambda self, x, u, p: {"speed": x.vel}}, "values of outputs: "),
        ({"shown": lambda self, x, u, p: [x.vel]}, "shown of changed: wanted a dictionary of val"),
        (
            {"outputs": (Output("nes"),)},
            "output nes of changed: wanted a state, nis, accepted, rejected or key of",
        ),
        ({"outputs": (Output("pos", "mm"),)}, "wanted the unit of the state, m, found 'mm'"),
        (
            {"shows": lambda self, x, u, p: {}},
            "wanted names that are used, as shown, found 'shows'",
        ),
        (
            {"measure": lambda self, x, u, p: [Measurement(u.z, [x.pos, x.vel], p.r)]},
            "measurement, h: wanted a number, found a list",
        ),
        ({"noise": lambda self, x, u, p: {"vel": p.r - 1.0}}, "a variance of 0 or more"),
        ({"noise": lambda self, x, u, p: {("vel", "vel"): 1.0}}, "pairs of pos, vel"),
        (
            {"noise": lambda self, x, u, p: {"pos": 0.01, "vel": 4.0, ("pos", "vel"): -0.25}},
            "noise of changed, pos and vel: wanted a covariance of at most 0.2, the root of",
        ),
        ({"initial_covariance": {("pos", "vel"): 4.1}}, "found {('pos', 'vel'): 4.1}; lower them"),
        ({"states": 3}, "wanted states: a tuple, found 3; write states = (...,)"),
        ({"least_word": "20"}, "wanted least_word: a whole number, found '20'"),
        ({"initial_covariance": [("pos", "vel", 0.1)]}, "wanted initial_covariance: a dictionary"),
        ({"initial_covariance": {("pos", "vel", "pos"): 0.1}}, "pairs of pos, vel"),
        ({"measure": lambda self, x, u, p: []}, "a list of Measurement(z, h, r), found none"),
        ({"measure": lambda self, x, u, p: [x.pos]}, "a list of Measurement(z, h, r)"),
        (
            {"measure": lambda self, x, u, p: [Measurement(u.z, u.there, p.r)]},
            "h that depends on a state, found one that does not; compute h from x",
        ),
        (
            {"measure": lambda self, x, u, p: [Measurement(u.z, x.pos, p.r - 1.0)]},
            "a variance above 0, found [-0.99, 3]; raise the least value of its parameters",
        ),
        (
            {"measure": lambda self, x, u, p: [Measurement(u.z, x.pos, 0.0)]},
            "a variance above 0, found [0, 0]; give the noise's",
        ),
        (
            {"measure": lambda self, x, u, p: [Measurement(u.z, ops.sqrt(x.pos * x.pos), p.r)]},
            "a derivative by pos with a finite range",
        ),
        (
            {"measure": lambda self, x, u, p: [Measurement(0.5, np.arctan2(x.pos, x.vel), 1.0)]},
            "0 out of the range of x or y of an arc tangent",
        ),
        (
            {"measure": lambda self, x, u, p: [Measurement(u.z, x.pos, -0.1)]},
            "found [-0.1, -0.1]; give the noise",
        ),
        (
            {"measure": lambda self, x, u, p: [Measurement(u.z, x.pos, p.r, valid=u.there)]},
            "measurement, valid: wanted a condition such as x > 0.5, found a traced",
        ),
        (
            {"measure": lambda self, x, u, p: [Measurement(u.z, x.pos, p.r, wrap=True)]},
            "measurement, wrap: wanted an angle in half turns, found 'm'",
        ),
        (
            {"measure": lambda self, x, u, p: [Measurement(u.z, x.pos, p.r, wrap="no")]},
            "wrap: True or False, found 'no'",
        ),
        (
            {
                "inputs": (Input("z", -180.0, 180.0, "deg"),),
                "outputs": (Output("pos"),),
                "measure": lambda self, x, u, p: [Measurement(u.z + p.q, x.pos, p.r)],
            },
            "measurement: wanted angles over a full turn of 360 deg in half turns, which wrap",
        ),
        (
            {"inputs": (Input("z", -9.0, 9.0, "km"), Input("there", 0.0, 1.0))},
            "measurement, h: wanted the unit of z, km, found 'm'; declare both in one unit",
        ),
        (
            {"params": (Param("r", 0.25, 0.01, 4.0, "s"), Param("q", 0.5, 0.001, 8.0))},
            "measurement, r: wanted the square of the unit of z and h, m, found 's'",
        ),
        ({"measure": lambda self, x, u, p: [Measurement(u.z, x.pos)]}, "arguments of the call"),
        ({"noise": lambda self, x, p: {}}, "noise of changed: wanted noise(self, x, u, p)"),
        ({"floor": -1.0}, "changed, floor: wanted a share from 0 to 1, found -1.0"),
        ({"floor": "x"}, "wanted floor: a number, found 'x'"),
        ({"dither": "no"}, "changed: wanted dither: True or False, found 'no'"),
        ({"measure": lambda self, x, u, p: [Measurement(u.z, x.pos, p.r, gate=0.0)]}, "a gate"),
        ({"measure": lambda self, x, u, p: [Measurement(u.z, x.pos, p.r, sd_max=0.0)]}, "sd_max"),
        (
            {"measure": lambda self, x, u, p: [Measurement(u.z, x.pos, p.r, sd_max=1.0)]},
            "sd_max: wanted none, for h is the state pos, found 1.0; declare it as sd_max of pos",
        ),
        (
            {"measure": lambda self, x, u, p: [Measurement(u.z, x.pos, p.r, slope_max={"pos": 3})]},
            "a power of two as slope_max of pos, found 3; state the next larger one, 2**2",
        ),
        (
            {
                "measure": lambda self, x, u, p: [
                    Measurement(u.z, x.pos, p.r, slope_max={"po": 2.0})
                ]
            },
            "slope_max of states",
        ),
    ],
)
def test_mistakes_have_one_line(members: dict[str, Any], said: str) -> None:
    assert said in refused(changed(**members))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: State("pos", -1.0, 1.0), "found no sd"),
        (lambda: State("pos", -1.0, 1.0, sd=2.0, sd_max=1.0), "found sd 2, sd_max 1"),
        (lambda: Attitude("q"), "found no sd"),
        (lambda: Attitude("q", sd=(0.1, 0.2)), "q: wanted sd of 1 or 3 numbers, found (0.1, 0.2)"),
        (lambda: Attitude("q", sd=[0.1]), "q: wanted sd of 1 or 3 numbers, found [0.1]"),
        (lambda: Attitude("q", sd=None), "q: wanted sd of 1 or 3 numbers, found none"),
        (lambda: Attitude("q", sd=0.1, sd_max="a"), "q: wanted sd_max of 1 or 3 numbers"),
        (lambda: Attitude("q", sd=0.1, initial=1.0), "q: wanted initial of 4 numbers, found 1.0"),
        (lambda: Attitude("q", sd=0.1, initial=(1.0, 1.0, 0.0, 0.0)), "a unit quaternion"),
        (lambda: vector(State, "v", "abc", -1.0, 1.0, sd=1.0), "one of xyz, enu, ned"),
    ],
)
def test_declarations_that_are_refused(make: Any, said: str) -> None:
    assert said in refused(make)


def test_a_filter_without_measure_is_refused() -> None:
    class Blind(Kalman):
        inputs = Cart.inputs
        states = Cart.states

    assert "a method measure(self, x, u, p)" in refused(Blind)


def test_names_of_what_the_filter_counts_are_its_own() -> None:
    for name in ("nis", "accepted", "gate_accepted_0"):
        shown = {"shown": lambda self, x, u, p, name=name: {name: x.pos}}
        taken = type("Taken", (Gated,), {**shown, "outputs": (Output(name),)})
        with pytest.raises(InputError, match=f"found '{name}'; rename it"):
            taken().compile()
