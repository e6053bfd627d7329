"""Declarations of `satcom`: a start without a restart record is the one with default parameters."""

import pytest

from boresight.systems.satcom.interface import BIAS_UNIT, INPUTS, OUTPUTS, PARAMS, STATES

DEFAULT = {p.name: p.default for p in PARAMS}
INITIAL = {s.name: s.initial for s in STATES}


def test_covariance_starts_as_the_parameters_say() -> None:
    attitude = (0.5 * DEFAULT["scale"] * DEFAULT["p0_sd"]) ** 2
    bias = (DEFAULT["scale"] * BIAS_UNIT * DEFAULT["bias_p0_sd"]) ** 2
    for k in range(6):
        assert INITIAL[f"p{k}{k}"] == pytest.approx(attitude if k < 3 else bias, rel=1e-6)
    assert not any(INITIAL[f"p{i}{j}"] for i in range(6) for j in range(i + 1, 6))


def test_attitude_starts_at_the_default_heading() -> None:
    assert DEFAULT["start_heading"] == 0.0 == INITIAL["heading_pi"]
    assert [INITIAL[f"q{a}"] for a in "wxyz"] == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=1e-9)


def test_a_tracking_sample_is_an_error_and_its_beam() -> None:
    inputs = {i.name: i for i in INPUTS}
    assert inputs["tracking"].flags == ("e_psi", "beam")
    assert (inputs["e_psi"].missing, inputs["beam"].missing) == (0.0, "hold")


def test_accuracy_is_judged_by_what_is_asked_for() -> None:
    """0.005 deg of each angle; the status bit by bit."""
    tolerances = {o.name: o.tolerance for o in OUTPUTS}
    assert {tolerances[n] for n in ("roll", "pitch", "heading", "heading_pi")} == {2.7e-5}
    assert tolerances["status"] is None
