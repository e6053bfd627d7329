"""VQF against the published implementation; in fixed point."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.attitude.vqf import Vqf
from boresight.model.resolve import estimator_of
from boresight.sim.fit.observe import hostile
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import CompiledFloat, Emitted
from boresight.sim.records.feed import feed, fitted
from boresight.sim.records.files import bundled, read_record
from tests.support.attitude.vqf_package import angle_deg, by_package, inputs_of, journey

# -- VQF in float64 is the package of its authors, to 1e-6 deg and in every decision --------------

RATE = 25.0


class Run:
    """Outputs of the compiled float64 of one estimator."""

    def __init__(self, estimator: Vqf) -> None:
        self.estimator, self.level = estimator, CompiledFloat(Build(estimator))

    def __call__(self, inputs: Any) -> tuple[Any, Any]:
        """Attitudes (n, 4) and status (n,)."""
        self.level.reset()
        self.out = out = self.level.run(inputs).outputs
        return np.stack([out[f"q{a}"] for a in "wxyz"], axis=1), out["status"].astype(int)


@pytest.fixture(scope="module")
def full() -> Run:
    return Run(Vqf(RATE))


@pytest.fixture(scope="module")
def six() -> Run:
    return Run(Vqf(RATE, mag="none"))


def equal(run: Run, inputs: Any) -> tuple[Any, Any]:
    """Compare with the package; status and the package's results."""
    q, status = run(inputs)
    theirs = by_package(run.estimator, inputs)
    assert angle_deg(q, theirs["q"]).max() < 1e-6
    angles = Rotation.from_quat(theirs["q"][:, [1, 2, 3, 0]]).as_euler("ZXY") / np.pi
    values = np.stack([run.out[n] for n in ("heading", "pitch", "roll")], axis=1)
    upright = np.abs(angles[:, 1]) < 0.45  # near the vertical they mean little
    assert np.abs((values - angles + 1.0) % 2.0 - 1.0)[upright].max() < 1e-7
    assert np.array_equal((status >> 5) & 1, theirs["rest"])
    if run.estimator.settings.magnetic:
        assert np.array_equal((status >> 4) & 1, theirs["disturbed"])
    return status, theirs


@pytest.mark.parametrize("seed", [1, 2])
def test_a_journey_with_every_decision(full: Run, seed: int) -> None:
    status, theirs = equal(full, inputs_of(full.estimator, journey(RATE, seed=seed)))
    t = np.arange(len(status)) / RATE
    rest, disturbed = theirs["rest"], theirs["disturbed"]
    assert rest[(t > 3.0) & (t < 5.0)].all() and not rest[(t > 8.0) & (t < 40.0)].any()
    assert rest[(t > 44.0) & (t < 46.0)].all()
    assert not disturbed[(t > 15.0) & (t < 25.0)].any()  # the first field was taken over
    assert disturbed[(t > 26.0) & (t < 39.5)].all()
    assert disturbed[(t > 51.0) & (t < 115.0)].all()  # for more than the minute of rejection
    assert not disturbed[-50:].any()  # the new field became the reference


def test_a_rare_magnetometer_and_20_s_without() -> None:
    run = Run(Vqf(RATE, mag_rate_hz=RATE / 3))
    records = journey(RATE, seconds=100.0, every=3, seed=3)
    records[1200:1700, 4:7] = 0.0
    status, _ = equal(run, inputs_of(run.estimator, records))
    assert set((status[:20] >> 3) & 1) == {0, 1} and ((status[1200:1700] >> 3) & 1).all()


def test_without_magnetometer(six: Run) -> None:
    status, _ = equal(six, inputs_of(six.estimator, journey(RATE, seconds=80.0, seed=4)))
    assert not (status & 0b11011).any()
    assert [i.name for i in six.estimator.inputs] == ["dt", *["gx", "gy", "gz", "ax", "ay", "az"]]


def test_a_recording() -> None:
    record = read_record(bundled("ximu_walk"))
    made = fitted(Vqf(), record)
    assert isinstance(made, Vqf) and made.settings.rate_hz == 256.0
    equal(Run(made), feed(made, record).inputs[:8000])


def test_a_turn_faster_than_any_bias_is_no_rest(six: Run) -> None:
    records = np.zeros((200, 10))
    records[:, 0], records[:, 2], records[:, 9] = 1.0 / RATE, np.radians(-2.05), 9.81
    status, _ = equal(six, inputs_of(six.estimator, records))
    assert not ((status >> 5) & 1).any()


def test_a_restart_is_a_new_start(full: Run) -> None:
    records = inputs_of(full.estimator, journey(RATE, seconds=60.0))
    at = round(45.2 * RATE)  # at rest, of which nothing may be left either
    again = records.copy()
    again[at - 1, 0] = -0.1
    again[at:] = records[: len(records) - at]
    q, status = full(again)
    wanted, flags = full(records)
    assert status[at - 2] == 0b100000
    assert np.abs(q[at:] - wanted[: len(records) - at]).max() < 1e-15
    assert np.array_equal(status[at:], flags[: len(records) - at])
    assert status[at - 1] & 1 and not (status[: at - 1] & 1).any()


def test_a_gap_is_turned_through(full: Run, six: Run) -> None:
    """Samples left out of an even turn about the vertical: the heading goes on as if they were."""
    n, rate = 500, 0.8
    records = np.zeros((n, 10))
    records[:, 0], records[:, 3], records[:, 9] = 1.0 / RATE, rate, 9.81
    present = np.ones(n, dtype=bool)
    present[300:304] = present[420:421] = False
    short = records[present]
    short[300, 0], short[416, 0] = 5.0 / RATE, 2.0 / RATE
    whole = six(inputs_of(six.estimator, records))[0][present]
    assert angle_deg(six(inputs_of(six.estimator, short))[0], whole).max() < 0.01
    short[:, 0] = 1.0 / RATE  # not told
    assert angle_deg(six(inputs_of(six.estimator, short))[0], whole)[-1] > 5.0


def test_made_for_the_rates_of_a_log() -> None:
    made = Vqf()
    assert made.for_rates({"dt": 100.05}) is made
    other = made.for_rates({"dt": 285.7142861, "mx": 28.57})
    assert (other.settings.rate_hz, other.settings.mag_rate_hz) == (285.714, 28.57)
    six = Vqf(mag="none").for_rates({"dt": 50.0})
    assert (six.name, six.settings.rate_hz, six.settings.magnetic) == ("vqf_six_axis", 50.0, False)
    named = estimator_of("vqf(rate_hz=256, mag_rate_hz=64)")
    assert isinstance(named, Vqf) and named.rates_hz == {"dt": 256.0, "mx": 64.0}


# -- VQF in fixed point: as float64, every decision the same, nothing saturates at extremes -------


def attitude(outputs: Any) -> Any:
    return np.stack([outputs[f"q{a}"] for a in "wxyz"], axis=1)


@pytest.mark.parametrize("mag", ["full", "none"])
def test_as_float64(mag: str) -> None:
    made, bound = Vqf(RATE, mag=mag), 1e-3
    build = Build(made)
    records = inputs_of(made, journey(RATE))
    fixed, real = Emitted(build).run(records), CompiledFloat(build).run(records)
    off = angle_deg(attitude(fixed.outputs), attitude(real.outputs))
    assert 1e-7 < off.max() < bound
    assert np.array_equal(fixed.outputs["status"], real.outputs["status"])
    assert fixed.saturated is not None and not fixed.saturated.any()
    for name in ("pitch", "roll", "heading"):
        d = np.abs((fixed.outputs[name] - real.outputs[name] + 1.0) % 2.0 - 1.0) * 180.0
        assert np.quantile(d, 0.99) < bound


def _hostile(made: Vqf, dt: float) -> dict[str, Any]:
    rng = np.random.default_rng(3)
    full = np.stack([rng.uniform(i.low, i.high, 1500) for i in made.inputs], axis=1)
    full[:, 0] = np.where(rng.random(1500) < 0.01, -0.1, dt)
    ends = np.array([[rng.choice([i.low, i.high]) for i in made.inputs] for _ in range(150)])
    stimuli = hostile(made, 700, rng)
    for records in stimuli.values():
        records[:, 0] = dt
    return stimuli | {"full": full, "ends": np.repeat(ends, 10, axis=0)}


@pytest.mark.parametrize("rate_hz, mag_rate_hz", [(10.0, 1.0), (200.0, 200.0), (1000.0, 30.0)])
def test_nothing_saturates_and_the_norm_is_kept(rate_hz: float, mag_rate_hz: float) -> None:
    made = Vqf(rate_hz, mag_rate_hz)
    rng = np.random.default_rng(4)
    level = Emitted(Build(made))
    cases: list[dict[str, float]] = [{}]
    cases += [{q.name: float(rng.choice([q.low, q.high])) for q in made.params} for _ in range(8)]
    stimuli = _hostile(made, 1.0 / rate_hz)
    for case in cases:
        level.set_params(made.param_values(case))
        for name, records in stimuli.items():
            level.reset()
            run = level.run(records)
            assert run.saturated is not None and not run.saturated.any(), (case, name)
            q = attitude(run.outputs)
            assert np.abs(np.linalg.norm(q, axis=1) - 1.0).max() < 1e-6, (case, name)
