"""The filter, in float64, is the published equations: prediction and every kind of measurement."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from boresight.systems.ekf2.estimator import KINDS, UNITS, Ekf2
from tests.support.ekf2_book import Book, matrix, unit

NOISE = ("q_g", "q_a", None, "q_bg", "q_ba", "q_field", "q_body")
NAMES = [
    *(
        n + a
        for n, axes in (("v", "ned"), ("p", "ned"), ("bg", "xyz"), ("ba", "xyz"))
        for a in axes
    ),
    *(n + a for n, axes in (("m", "ned"), ("mb", "xyz")) for a in axes),
    *("wind_n", "wind_e", "terrain"),
]
AXES = {
    **dict.fromkeys(
        ("velocity", "position", "body_velocity", "field", "gravity"), (0.6, -0.48, 0.64)
    ),
    **{"sideslip": (0.0, 1.0, 0.0), "drag": (0.8, 0.6, 0.0), "flow": (-0.6, 0.8, 0.0)},
}


@pytest.fixture(scope="module")
def ekf() -> Ekf2:
    class Unfloored(Ekf2):
        floor = 0.0

    return Unfloored()


def drawn(ekf: Ekf2, seed: int) -> Book:
    """Random flight: level within 60 degrees, forward through the air, P of random directions."""
    draw = np.random.default_rng(seed)
    q = unit(np.array([1.0, *draw.normal(0.0, 0.25, 3)]))
    x = np.zeros(24)
    x[21:23] = draw.normal(0.0, 3.0, 2)
    x[3:6] = matrix(q) @ [12.0, *draw.normal(0.0, 1.0, 2)] + np.array([*x[21:23], 0.0])
    x[6:9], x[23] = draw.normal(0.0, 30.0, 3), 60.0
    x[9:12], x[12:15] = draw.normal(0.0, 0.01, 3), draw.normal(0.0, 0.1, 3)
    x[15:18], x[18:21] = draw.normal((0.2, 0.0, 0.4), 0.02), draw.normal(0.0, 0.02, 3)
    sd = 0.3 * np.array(ekf.largest_sd)
    spread = sd[:, None] * np.linalg.qr(draw.normal(size=(24, 24)))[0]
    return Book(q, x, spread @ np.diag(draw.uniform(0.3, 1.0, 24)) @ spread.T)


def params_of(ekf: Ekf2) -> dict[str, float]:
    """Near the defaults, no two alike."""
    return {p.name: p.default * (1.0 + 0.1 * k) for k, p in enumerate(ekf.params)}


def stepped(ekf: Ekf2, book: Book, inputs: dict[str, float]) -> Book:
    """The filter's own update of the same state."""
    states = dict(zip(("qw", "qx", "qy", "qz"), book.q, strict=True))
    states |= dict(zip(NAMES, book.x[3:], strict=True))
    states |= {name: book.cov[i, j] for name, (i, j) in ekf.covariance_states.items()}
    params = params_of(ekf)
    after, _ = ekf.step(*(SimpleNamespace(**d) for d in (states, inputs, params)))
    cov = np.zeros((24, 24))
    for name, (i, j) in ekf.covariance_states.items():
        cov[i, j] = cov[j, i] = after[name]
    x = np.array([0.0, 0.0, 0.0, *(after[n] for n in NAMES)])
    return Book(np.array([after["q" + c] for c in "wxyz"]), x, cov)


def inputs_of(draw: np.random.Generator, **row: float) -> dict[str, float]:
    rates, forces = draw.normal(0.0, 0.5, 3), draw.normal((0.0, 0.0, -9.8), 2.0)
    given = {f"g{a}": w for a, w in zip("xyz", rates, strict=True)}
    given |= {f"a{a}": f for a, f in zip("xyz", forces, strict=True)}
    return (
        given | {"kind": 0.0, "axis_x": 0.0, "axis_y": 0.0, "axis_z": 0.0, "z": 0.0, "r": 1.0} | row
    )


def predicted(ekf: Ekf2, book: Book, inputs: dict[str, float]) -> None:
    p = params_of(ekf)
    noise = [*np.repeat([0.0 if n is None else p[n] for n in NOISE], 3)]
    noise += [p["q_wind"], p["q_wind"], p["q_terrain"]]
    gyro, force = (np.array([inputs[n + a] for a in "xyz"]) for n in "ga")
    book.predict(gyro, force, np.array(noise))


def same(ours: Book, book: Book, ekf: Ekf2) -> None:
    """Within 1e-9 of their sizes: P in shares of the standard deviations."""
    most = np.array(ekf.largest_sd)
    assert np.abs(ours.q - book.q).max() < 1e-9
    assert np.abs((ours.x - book.x) / np.maximum(np.abs(book.x), most)).max() < 1e-9
    assert np.abs((ours.cov - book.cov) / np.outer(most, most)).max() < 1e-9
    assert np.abs(np.diag(ours.cov) / np.diag(book.cov) - 1.0).max() < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_prediction(ekf: Ekf2, seed: int) -> None:
    book = drawn(ekf, seed)
    before = book.cov.copy()
    inputs = inputs_of(np.random.default_rng([seed, 1]))
    ours = stepped(ekf, book, inputs)
    predicted(ekf, book, inputs)
    same(ours, book, ekf)
    assert np.abs(book.cov - before).max() > 1e-4


@pytest.mark.parametrize("kind", KINDS[1:])
@pytest.mark.parametrize("seed", range(2))
def test_measurement(ekf: Ekf2, kind: str, seed: int) -> None:
    book = drawn(ekf, seed)
    axis = np.array(AXES.get(kind, (0.0, 0.0, 0.0)))
    inputs = inputs_of(np.random.default_rng([seed, 2]))
    p = params_of(ekf)
    ahead = Book(book.q, book.x, book.cov)
    predicted(ekf, ahead, inputs)
    # one standard deviation and a half off
    r = 0.25
    none, h = ahead.row(kind, axis, 0.0, p["drag"], p["rotor"])
    z = 1.5 * np.sqrt(h @ ahead.cov @ h + r / UNITS[kind] ** 2) - none
    z = (z + np.pi) % (2.0 * np.pi) - np.pi if kind == "heading" else z
    inputs |= {"kind": float(KINDS.index(kind)), "z": UNITS[kind] * z, "r": r}
    inputs |= {f"axis_{a}": c for a, c in zip("xyz", axis, strict=True)}
    ours = stepped(ekf, book, inputs)
    innovation, h = ahead.row(kind, axis, z, p["drag"], p["rotor"])
    before = Book(ahead.q, ahead.x, ahead.cov)
    ahead.update(innovation, h, r / UNITS[kind] ** 2)
    same(ours, ahead, ekf)
    assert np.abs((ahead.x - before.x)[3:]).max() > 1e-3


@pytest.mark.parametrize(("deviations", "counts"), [(4.9, True), (5.1, False)])
def test_beyond_its_gate_a_measurement_counts_nothing(
    ekf: Ekf2, deviations: float, counts: bool
) -> None:
    book = drawn(ekf, 5)
    inputs = inputs_of(np.random.default_rng(3), kind=1.0, axis_x=1.0)
    ahead = Book(book.q, book.x, book.cov)
    predicted(ekf, ahead, inputs)
    apart = deviations * np.sqrt(ahead.cov[3, 3] + 1.0 / 16.0)
    ours = stepped(ekf, book, inputs | {"z": 4.0 * (ahead.x[3] + apart)})
    if counts:
        ahead.update(apart, np.eye(24)[3], 1.0 / 16.0)
    same(ours, ahead, ekf)
