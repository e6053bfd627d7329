"""Figures of a run, rows of a log in its cases, and what the command prints."""

import json

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.attitude.robustness import runs
from boresight.sim.attitude.robustness.__main__ import main, robustness
from boresight.sim.attitude.robustness.plan import Case, cases_of
from boresight.sim.attitude.robustness.runs import Suite, figures_of, run_log
from boresight.sim.attitude.robustness.summary import summary
from boresight.sim.attitude.worlds.synthetic import synthetic_log
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import euler_to_quaternion, quaternion_multiply


@pytest.fixture(scope="module")
def log() -> NineAxis:
    return NineAxis.of(synthetic_log(seconds=20.0, rate_hz=50.0, seed=1, acceleration=0.3))


def test_the_first_second_does_not_count(log: NineAxis) -> None:
    assert log.attitude is not None
    q = log.attitude.copy()
    turn = euler_to_quaternion(np.radians([0.0, 0.0, 6.0]))
    q[:50] = quaternion_multiply(turn, q[:50])
    figures = figures_of(log, q)
    assert figures["total"] == pytest.approx(0.0, abs=1e-5)
    q[50:] = quaternion_multiply(turn, q[50:])
    assert figures_of(log, q)["heading"] == pytest.approx(6.0)


def test_an_estimator_knows_the_full_scale_of_the_case(log: NineAxis) -> None:
    """The gyro's range is a parameter for this case alone."""
    (fast,) = (case for case in cases_of("full") if case.name == "fast turns")
    turned = fast.work(log)
    built: runs.Levels = {}
    late = []
    for scale in ((), ("gyr",), ()):
        _, (fixed, _) = runs.run_estimator("mekf", turned, scale, built)
        late.append(int((np.rint(fixed.outputs["status"]).astype(int) >> 6 & 1).sum()))
    assert late[1] > 100 and late[0] == late[2] == 0


def test_an_estimator_without_attitude_is_refused(log: NineAxis) -> None:
    rows = run_log(Suite("short", ["pmsm"]), log)
    assert all(set(row) >= {"refused"} for row in rows)


def test_rows_and_tables(tmp_path, capsys) -> None:
    out = tmp_path / "rows.json"
    assert main(["complementary,vqf_online", "--cases", "short", "-o", str(out)]) == 0
    data = json.loads(out.read_text())
    rows = {(r["case"], r["filter"], r["level"]): r for r in data["rows"]}
    fixed, floating = (rows["as recorded", "complementary", n] for n in ("fixed", "float"))
    assert fixed["total"] == pytest.approx(floating["total"], abs=1e-3) and fixed["good"]
    assert 0.0 < fixed["apart_deg"] < 1e-3 and fixed["saturated"] == 0
    assert rows["bias 0.7 deg/s", "vqf_online", "package"]["total"] > 0.0
    printed = capsys.readouterr().out
    assert "starts anywhere" in printed and "Ratio to vqf_online" in printed
    assert main(["nothing", "--cases", "short"]) == 1


def test_means_ratios_and_failures() -> None:
    cases = [Case(n, g, lambda log: log) for n, g in (("a", "a"), ("p0", "p"), ("p1", "p"))]

    def row(log: str, case: str, name: str, total: float, **more: object) -> dict[str, object]:
        group = case[0]
        return dict(log=log, case=case, group=group, filter=name, level="fixed", total=total) | more

    rows = [
        row("x", "a", "mine", 1.0),
        row("y", "a", "mine", 4.0, good=False, apart_deg=0.5, saturated=2),
        row("x", "a", "vqf_online", 2.0),
        row("y", "a", "vqf_online", 3.0),
        row("x", "p0", "mine", 9.0),
        {"log": "x", "case": "p0", "group": "p", "filter": "vqf_online", "level": "package",
         "refused": "no"},
    ]  # fmt: skip
    result = summary(cases, rows)
    assert [r["mine"] for r in result["errors_deg"]] == [2.5, 9.0]
    (ratio,) = result["against_rival"]
    assert ratio["ratio"] == 1.0 and ratio["in"] == "y, a"
    assert ratio["worst"] == pytest.approx(4.0 / 3.0)
    assert [line.split(":")[0] for line in result.failures] == ["mine", "vqf_online"]


def test_unknown_cases_are_refused() -> None:
    with pytest.raises(InputError, match="--cases: wanted one of"):
        robustness(["mekf"], cases="long")
