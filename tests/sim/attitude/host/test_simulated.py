"""Trials of faults as data and as a table."""

from __future__ import annotations

from boresight.sim.attitude.board.faults import FaultTrial
from boresight.sim.attitude.host.simulated import faults_result

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


def test_faults_as_a_table() -> None:
    result = faults_result("mekf", (SEEN, HARMLESS))
    _, first, second, verdict = str(result).splitlines()
    assert "adis absent" in first and "never" in first and first.endswith("FAILED")
    assert second.endswith("no effect") and verdict == "FAILED: adis absent"
    data = result.to_json()
    assert data["filter"] == "mekf" and not data["good"]
    assert [(t["device"], t["good"]) for t in data["trials"]] == [("adis", False), ("hmr", True)]
    assert faults_result("mekf", (HARMLESS,)).good
