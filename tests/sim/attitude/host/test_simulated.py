"""The simulated board's figures as data and as tables."""

from __future__ import annotations

from boresight.sim.attitude.board.faults import FaultTrial
from boresight.sim.attitude.host.simulated import BoardFigures, FaultsResult, runs_table

SEEN = FaultTrial(
    device="adis",
    fault="absent",
    fault_s=0.2,
    seen_after_s=0.004,
    seen_as=("inertial_no_data_ready",),
    dropped=329,
    before_deg=1.0,
    during_deg=2.7,
    after_deg=0.8,
    back_after_s=None,
)
HARMLESS = FaultTrial("hmr", "noise", 0.1, None, (), 0, 1.0, 1.0, 0.9, 0.01)
ROW = BoardFigures(
    "mekf", 51, 51, 0, "", 0, 2, 5, (7, 9), (300, 301), 299, 0.02, 90.25, 90.25, 700.0, 0, 0,
    1000, 5000, True,
)  # fmt: skip


def test_faults_as_a_table() -> None:
    result = FaultsResult("mekf", (SEEN, HARMLESS))
    _, first, second = str(result).splitlines()
    assert "adis absent" in first and "never" in first and first.endswith("FAILED")
    assert second.endswith("no effect") and not result.good
    data = result.to_json()
    assert list(data) == ["filter", "good", "trials"]
    assert [(t["device"], t["good"]) for t in data["trials"]] == [("adis", False), ("hmr", True)]
    assert FaultsResult("mekf", (HARMLESS,)).good


def test_runs_as_a_table() -> None:
    head, row = runs_table((ROW,)).splitlines()
    assert head.split()[:2] == ["filter", "updates"]
    assert row.split()[:5] == ["mekf", "51", "0", "0", "2"] and "90.25 us" in row
