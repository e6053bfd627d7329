"""Verdicts: what is met, what is not, what does not bind."""

from typing import Any

from boresight.sim.experiments.mls.targets import _CLAIMED, _ROWS, targets_of

GOOD = {
    **{"mls_roll_deg": 0.126, "mls_prototype_roll_deg": 0.128, "mls_innovation_28_roll_deg": 0.126},
    **{"mls_gyro_only_roll_deg": 0.5, "mls_beam_0_deg": 0.1, "mls_beam_60_deg": 0.3},
    **{"array64_x_01_0_gain": 0.95, "array64_x_05_0_gain": 0.31, "array64_x_01_0_width": 1.59},
    **{"array64_y_01_0_width": 1.59, "array64_y_05_0_sidelobe_db": -17.8},
    **{"array64_z_05_0_sidelobe_db": -17.5, "array64_z_05_0_at_30_sidelobe_db": -11.0},
    **{"mls_sea_5_uncompensated_0_deg": 0.02, "mls_sea_5_beam_0_deg": 0.06},
}


def verdicts(given: dict[str, float]) -> dict[str, Any]:
    """By name; figures that are not given are 1."""
    keys = [row[2] for row in (*_ROWS, *(claimed for claimed, _ in _CLAIMED))]
    cases = ("", "prototype_", "innovation_28_", "gyro_only_")
    keys += [f"mls_{c}{axis}_deg" for c in cases for axis in ("roll", "pitch", "heading")]
    keys += [k for k in GOOD if k not in keys]
    return {t.name: t for t in targets_of(dict.fromkeys(keys, 1.0) | given)}


def test_verdicts() -> None:
    found = verdicts(GOOD)
    assert found["X, b = 0.1: usable at 0, gain"].good
    assert found["beam at 0, compensated, rms, deg"].good
    assert not found["beam at 60, compensated, rms, deg"].good
    ratio = found["roll, rms, over prototype's, same runs"]
    assert ratio.good and ratio.binding and ratio.value == GOOD["mls_roll_deg"] / 0.128
    assert found["roll: gyro alone worse, times"].value == 0.5 / 0.126
    assert found["roll, rms, deg"].good and not found["roll, rms, deg"].binding


def test_what_is_claimed_and_not_true_has_a_reason_and_does_not_bind() -> None:
    found = verdicts(GOOD)
    broad = found["X, b = 0.1 broadens the pulse, times"]
    assert broad.value == 1.0 and not broad.good and not broad.binding and broad.note
    assert not found["Z, b = 0.5 raises side lobes at 3 deg, dB"].good
    assert found["the same at 30 deg, dB"].good
    restored = found["compensation restores pulses of (14), gain"]
    assert restored.value == 0.31 and not restored.good
    assert abs(found["carrier, sea state 5: beam better, times"].value - 1 / 3) < 1e-9


def test_all_that_binds_has_a_limit() -> None:
    for target in verdicts({}).values():
        assert target.low is not None or target.high is not None
        assert target.binding != bool(target.note)
