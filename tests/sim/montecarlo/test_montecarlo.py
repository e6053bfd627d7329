"""Draws, their figures, and draws on several machines."""

import pickle
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2 as exact

import boresight
from boresight import Estimator, Input, Output, World
from boresight.cli import main
from boresight.model.errors import ToolMissing
from boresight.sim.cluster import cluster
from boresight.sim.montecarlo.campaign import MOST_MARKS, Campaign, draws
from boresight.sim.montecarlo.figures import chi2, figures, text
from tests.support.drift import Constant, Mean

# -- figures of draws whose answer is known; quantiles against scipy ------------------------------


def made(n: int, seed: int, *, sd: float = 2.0, mean: float = 0.0, believed: float = 2.0):
    """Draws of a Gaussian error of one output at two marks, and what the filter believes."""
    rng = np.random.default_rng(seed)
    out = []
    for k in range(n):
        e = mean + sd * rng.normal(size=2)
        out.append(
            {
                "seed": k,
                "marks": [0, 9],
                "errors": {"a": e.tolist()},
                "nees": ((e / believed) ** 2).tolist(),
                "freedom": 1,
                "nis": [float((rng.normal(size=(20, 3)) ** 2).sum()), 20],
                "saturated": 1,
            }
        )
    return out


@pytest.mark.parametrize("freedom", [10, 99, 1500])
def test_quantiles(freedom: int) -> None:
    for p in (0.025, 0.5, 0.975):
        z = {0.025: -1.959964, 0.5: 0.0, 0.975: 1.959964}[p]
        assert chi2(freedom, z) == pytest.approx(exact.ppf(p, freedom), rel=1e-2)


def test_a_consistent_filter_lies_in_its_bands() -> None:
    result = figures(made(400, 1), {"a": np.full(10, 2.0)}, 3)
    spread = result["outputs"]["a"]
    assert (
        abs(spread["mean"][1]) < spread["mean_band"][1] == pytest.approx(1.96 * 2.0 / 20.0, rel=0.1)
    )
    assert spread["sd_band"][0][1] < 2.0 < spread["sd_band"][1][1]
    assert spread["ratio"][1] == pytest.approx(1.0, abs=0.08) and spread["bound"] == [2.0, 2.0]
    for key, mean in (("nees", result["nees"]["mean"][1]), ("nis", result["nis"]["mean"])):
        low, high = result[key]["band"]
        assert low < mean < high
    assert result["saturated"] == 400 == result["runs"]


def test_one_that_believes_too_much_or_is_biased_does_not() -> None:
    sure = figures(made(400, 1, believed=1.8), {}, 3)
    assert sure["nees"]["mean"][1] > sure["nees"]["band"][1]
    off = figures(made(400, 1, mean=0.5), {}, 0)["outputs"]["a"]
    assert off["mean"][1] > off["mean_band"][1] and "bound" not in off
    assert off["rms"][1] == pytest.approx(np.hypot(off["sd"][1], off["mean"][1]), rel=1e-2)


@pytest.mark.parametrize(
    ("believed", "verdict"), [(1.8, "too sure"), (2.0, "consistent"), (2.2, "too cautious")]
)
def test_the_verdict(believed: float, verdict: str) -> None:
    lines = text(figures(made(400, 1, believed=believed), {}, 0), {}).splitlines()
    (line,) = (line for line in lines if line.startswith("NEES"))
    assert verdict in line


def test_bounds_that_are_none() -> None:
    least = np.array([np.inf, *9 * [0.0]])
    spread = figures(made(20, 1), {"a": least}, 0)["outputs"]["a"]
    assert spread["bound"] == [None, None] == spread["ratio"]


def test_table() -> None:
    data = figures(made(50, 1), {"a": np.full(10, 2.0)}, 3)
    lines = text(data, {"a": "m"}).splitlines()
    assert lines[1].startswith("a ") and lines[1].endswith(" m") and lines[1].split()[4] == "2"
    assert lines[2].startswith("NEES per degree of freedom, in record 9 of each draw: ")
    assert lines[3].startswith("NIS per degree of freedom, over all updates that measure: ")
    assert lines[-1] == "50 draws, saturated updates: 50"


# -- one draw: errors at marks, NEES and NIS of hand, angles that wrap ----------------------------


def test_a_draw_by_hand() -> None:
    world = Constant(70)
    (result,) = draws(Campaign((world, Mean)), [7])
    world.draw(7)
    p, m, nis, errors, nees = 4.0, 0.0, 0.0, [], []
    for z in world.value + world.noise:
        nis += (z - m) ** 2 / (p + 1.0)
        m, p = m + p / (p + 1.0) * (z - m), p / (p + 1.0)
        errors.append(m - world.value)
        nees.append(errors[-1] ** 2 / p)
    marks = result["marks"]
    assert (result["seed"], result["records"], len(marks)) == (7, 70, MOST_MARKS)
    assert marks[0] == 0 and marks[-1] == 69
    assert result["errors"]["mean"] == pytest.approx(np.array(errors)[marks], abs=1e-6)
    assert result["nees"] == pytest.approx(np.array(nees)[marks], rel=1e-4)
    assert (result["freedom"], result["nis"][1]) == (1, 70)
    assert result["nis"][0] == pytest.approx(nis, rel=1e-4)


class Turned(World):
    def draw(self, seed: int) -> None:
        self.start()

    def start(self) -> None:
        self.k = 0

    def record(self, outputs: Any) -> Any:
        self.k += 1
        return None if self.k > 3 else {"a": 0.99, "b_true": -0.99}


class Through(Estimator):
    inputs = (Input("a", -1.0, 1.0, "ht"),)
    outputs = (Output("b", "ht"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"b": u.a}


def test_angles_wrap() -> None:
    (result,) = draws(Campaign((Turned(), Through)), [1])
    assert result["errors"]["b"] == pytest.approx(3 * [-0.02], abs=1e-6)
    assert result["nees"] == [] and result["nis"] == [0.0, 0]


# -- dask: the line that says what to install, and the same figures from two workers --------------

DRIFT = Path(__file__).parents[2] / "support" / "drift.py"
TEXTS = (f"{DRIFT}:Constant", f"{DRIFT}:Mean")


def test_another_process_has_one_campaign_until_its_files_change(tmp_path) -> None:
    file, received = tmp_path / "drift.py", list[Campaign]()
    for start in (4.0, 3.0):
        file.write_text(DRIFT.read_text().replace('"", 4.0', f'"", {start}'))
        sent = Campaign((f"{file}:Constant", f"{file}:Mean"), (("p0", 2.0),), "float", 24, 30)
        first, second = (pickle.loads(pickle.dumps(sent)) for _ in range(2))
        assert first is second and first == sent and "world" not in vars(first)
        received.append(first)
    assert received[0] == received[1] and received[0] is not received[1]


def test_without_dask_one_line_says_what_to_install(monkeypatch, tmp_path, capsys) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ToolMissing, match="pip install 'boresight"), cluster("tcp://here:8786"):
        pass
    arguments = ["montecarlo", *TEXTS, "--scheduler", "tcp://here:8786", "-o", str(tmp_path)]
    assert main(arguments) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_objects_cannot_go_to_a_cluster(tmp_path) -> None:
    from tests.support.drift import Constant, Mean

    with pytest.raises(boresight.InputError, match="^scheduler: wanted world and estimator by"):
        boresight.montecarlo(Constant, Mean, scheduler="tcp://here:8786", output=tmp_path)


@pytest.mark.filterwarnings("ignore")
def test_two_workers_give_what_one_process_gives(tmp_path) -> None:
    distributed = pytest.importorskip("distributed")
    names = [tmp_path / "one", tmp_path / "two"]
    boresight.montecarlo(*TEXTS, runs=12, jobs=1, output=names[0])
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None
    ) as here:
        boresight.montecarlo(*TEXTS, runs=12, scheduler=here.scheduler_address, output=names[1])
    first, two = ((n / "montecarlo-constant-mean.json").read_text() for n in names)
    assert first == two
