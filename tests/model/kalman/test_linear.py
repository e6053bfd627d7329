"""A filter of the matrices of other packages is the textbook's, in words."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import signal

import boresight
from boresight import kalman
from boresight.model.errors import InputError

A, B = np.array([[1.0, 0.1], [-0.2, 0.95]]), np.array([[0.0], [0.1]])
C, D = np.array([[1.0, 0.0], [0.5, 1.0]]), np.array([[0.0], [0.2]])
Q, R, P = np.array([[1e-4, 5e-5], [5e-5, 1e-3]]), np.diag([0.04, 0.09]), np.diag([1.0, 0.5])
R_FULL, P_FULL = R + 0.03 * np.eye(2)[::-1], P + 0.4 * np.eye(2)[::-1]
START = np.array([0.5, -0.2])
SIZES = {"x": [16.0, 16.0], "u": 4.0, "tolerance": 1e-5}

#: What only looks like objects of packages that are not here.
CONTROL = SimpleNamespace(
    A=A,
    B=B,
    C=C,
    D=D,
    dt=0.1,
    state_labels=["a", "b"],
    input_labels=["u[0]"],
    output_labels=["c", "d"],
)
FILTERPY = SimpleNamespace(F=A, B=B, H=C, Q=Q, R=R, P=P, x=START[:, None])
SYSTEMS = {
    "matrices": kalman.linear((A, B, C, D), **SIZES, Q=Q, R=R, P=P),
    "scipy": kalman.linear(
        signal.dlti(A, B, C, D, dt=1),
        **SIZES,
        Q=Q,
        R=[0.04, 0.09],
        P=P,
        sd_max={"x1": 1.5, "x0": 1.25},
        floor=2.0**-33,
    ),
    "control": kalman.linear(CONTROL, **SIZES, Q=Q, R=R, P=P, z=16.0),
    "filterpy": kalman.linear(FILTERPY, **SIZES),
    "correlated": kalman.linear((A, B, C, D), **SIZES, Q=Q, R=R_FULL, P=P_FULL),
}


@pytest.mark.parametrize("kind", SYSTEMS)
def test_the_filter_of_a_linear_system(kind: str) -> None:
    made, rng = SYSTEMS[kind](), np.random.default_rng(2)
    assert made.rates_hz == {"scipy": {"dt": 1.0}, "control": {"dt": 10.0}}.get(kind, {})
    u, z = np.sin(0.1 * np.arange(100)), rng.normal(0.0, 0.3, (100, 2))
    log = dict(zip([i.name for i in made.inputs], [u, *z.T], strict=True))
    (result,) = boresight.check(made, log, levels=("fixed", "c"))["results"]
    assert result.good, result.lines()
    x = START if kind == "filterpy" else np.zeros(2)
    cov, r = (P_FULL, R_FULL) if kind == "correlated" else (P, R)
    d = np.zeros((2, 1)) if kind == "filterpy" else D
    for k in range(100):
        x, cov = A @ x + B[:, 0] * u[k], A @ cov @ A.T + Q
        gain = cov @ C.T @ np.linalg.inv(C @ cov @ C.T + r)
        x, cov = x + gain @ (z[k] - C @ x - d[:, 0] * u[k]), (np.eye(2) - gain @ C) @ cov
        for state, value in zip(made.estimated, x, strict=True):
            assert abs(result.fixed.outputs[state.name][k] - value) < 1e-5
    if kind == "scipy":
        assert made.floor == 2.0**-33 and [s.sd_max for s in made.estimated] == [1.25, 1.5]
    assert [s.name for s in made.estimated] == (["a", "b"] if kind == "control" else ["x0", "x1"])


@pytest.mark.parametrize(
    ("system", "changed", "said"),
    [
        (signal.lti(A, B, C, D), {}, "time-discrete"),
        (
            (np.diag([1.0, 1.05]), B, C * [1.0, 0.0], D),
            {},
            "bound every error, found 'x1'; measure it",
        ),
        ((A, B, C[:, :1], D), {}, "C \\(m, n\\)"),
        ((A, B, C, D), {"R": None}, "give R="),
        ((A, B, C, D), {"P": [1.0, 0.0]}, "larger diagonal"),
        ((A, B, C, D), {"x": [1.0]}, "2 largest"),
        ((A, B, C, D), {"tolerance": {"a": 1.0, "x0": 1.0}}, "each state: x0, x1, found a, x0"),
        (signal.dlti([1.0], [1.0, -0.5], dt=0.1), {}, "TransferFunctionDiscrete'; convert it"),
        (
            SimpleNamespace(**vars(FILTERPY), alpha=1.05),
            {},
            "alpha: wanted 1, found 1.05; write such",
        ),
        (SimpleNamespace(**vars(FILTERPY), alpha=1.0, M=C), {}, "M: wanted 0, found array"),
    ],
)
def test_refused(system: object, changed: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        kalman.linear(system, **{**SIZES, "Q": Q, "R": R, "P": P, **changed})
