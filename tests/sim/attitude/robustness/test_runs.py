"""Figures of a run, rows of a log in its cases, and what the command prints."""

import json

import numpy as np
import pytest

from boresight.sim.attitude import robustness as suite
from boresight.sim.attitude.worlds import synthetic_log
from boresight.sim.records.files import content_of
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import euler_to_quaternion, quaternion_multiply


@pytest.fixture(scope="module")
def log() -> NineAxis:
    return NineAxis.of(synthetic_log(seconds=20.0, rate_hz=50.0, seed=1, acceleration=0.3))


def test_the_first_second_does_not_count(log: NineAxis) -> None:
    q = log.attitude.copy()
    turn = euler_to_quaternion(np.radians([0.0, 0.0, 6.0]))
    q[:50] = quaternion_multiply(turn, q[:50])
    assert suite.figures_of(log, q)["total"] == pytest.approx(0.0, abs=1e-5)
    q[50:] = quaternion_multiply(turn, q[50:])
    assert suite.figures_of(log, q)["heading"] == pytest.approx(6.0)


def test_an_estimator_knows_the_full_scale_of_the_case(log: NineAxis) -> None:
    """The gyro's range is a parameter for this case alone."""
    (fast,) = (case for case in suite.CASES if case.group == "fast turns")
    turned, built, late = fast.change(log), suite.Levels(), []
    for scale in ("", fast.full_scale, ""):
        _, (fixed, _) = suite.run_estimator("mekf", scale, turned, built)
        late.append(int((np.rint(fixed.outputs["status"]).astype(int) >> 6 & 1).sum()))
    assert late[1] > 100 and late[0] == late[2] == 0


def test_rows_and_tables(log: NineAxis, tmp_path, capsys) -> None:
    out, path = tmp_path / "rows.json", tmp_path / "log.csv"
    path.write_bytes(content_of(path, log.record()))
    assert suite.main(["complementary,vqf_online", str(path), "-o", str(out)]) == 0
    rows = json.loads(out.read_text())["rows"]
    assert len(rows) == 2 * len(suite.CASES)
    own = [r for r in rows if r["filter"] == "complementary"]
    assert all(not r["beyond"] and r["saturated"] == 0 and 0.0 < r["apart_deg"] < 1e-2 for r in own)
    printed = capsys.readouterr().out
    assert "starts anywhere" in printed and "Ratio to vqf_online" in printed
    assert suite.main(["nothing", str(path)]) == suite.main(["pmsm", str(path)]) == 2
    path.write_bytes(content_of(path, log.record().head(300)))
    assert suite.main(["complementary", str(path)]) == 2
    assert "wanted more than 6 s of motion with a reference attitude" in capsys.readouterr().err


def test_means_ratios_and_failures() -> None:
    def row(log: str, case: str, number: int, name: str, total: float, **more: object) -> dict:
        figures = {"total": total, "inclination": total / 2}
        return dict(log=log, case=case, number=number, filter=name) | figures | more

    first, group = "as recorded", "starts anywhere"
    refused = dict(log="x", case=group, number=4, filter="vqf_online", refused="no")
    rows = [
        row("x", first, 0, "mine", 1.0),
        row("y", first, 0, "mine", 4.0, beyond=["rate"], apart_deg=0.5, saturated=2),
        row("x", first, 0, "vqf_online", 2.0),
        row("y", first, 0, "vqf_online", 3.0),
        row("x", group, 4, "mine", 9.0),
        refused,
    ]
    result = suite.summary(rows)
    assert [r["mine"] for r in result["errors_deg"] if r["mine"]] == [2.5, 9.0]
    (ratio,) = result["against_rival"]
    assert (ratio["ratio"], ratio["of inclination"], ratio["in"]) == (1.0, 1.0, "y")
    assert ratio["worst"] == pytest.approx(4.0 / 3.0)
    mine, rival = result.failures
    assert "beyond the tolerance in rate, and 2 updates saturate, in y, as recorded" in mine
    assert rival == "vqf_online: 1 of 3 runs failed: no"
