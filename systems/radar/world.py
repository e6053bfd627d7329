"""Two radars that watch one target and report it in earth-fixed axes, as a `World`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
import pymap3d

from boresight import World
from boresight.model.arrays import FloatArray
from boresight.model.errors import require, require_choice
from boresight.systems.radar.estimator import BIASES

GM = 3.986004418e14  #: m^3/s^2
J2 = 1.08262668e-3
EQUATOR = 6378137.0  #: m
EARTH_RATE = 7.292115e-5  #: rad/s
#: Radars of the paper: longitude, latitude [deg], height [m].
SITES = ((115.74, 29.43, 5.0), (114.11, 30.71, 5.0))
_DEG = math.pi / 180.0
#: Range, elevation, azimuth of both radars [m, deg]: the paper's.
BIAS = (20.0, 0.1, 0.2, 20.0, 0.1, 0.2)
NOISE = (10.0, 0.07, 0.15, 10.0, 0.07, 0.15)
_UNITS = np.array([1.0, _DEG, _DEG] * 2)


# -- flights of a target in earth-fixed axes (WGS 84) ---------------------------------------------


def gravity(place: FloatArray) -> FloatArray:
    """Gravitation of the earth with J2 [m/s^2], without the centrifugal part, at (3,) [m]."""
    x, y, z = place
    square = x * x + y * y + z * z
    flat = 1.5 * J2 * EQUATOR**2 / square
    bulge = 5.0 * z * z / square
    side = 1.0 + flat * (1.0 - bulge)
    pull: FloatArray = (
        -GM / square**1.5 * np.array([x * side, y * side, z * (1.0 + flat * (3.0 - bulge))])
    )
    return pull


def ballistic(place: Sequence[float], velocity: Sequence[float], t: FloatArray) -> FloatArray:
    """Positions (n, 3) at times (n,) of a body that falls freely, in axes that turn with the earth.

    Runge and Kutta's fourth order, a step from each time to the next.
    """
    w = EARTH_RATE

    def rate(s: FloatArray) -> FloatArray:
        x, y, _, vx, vy, _ = s
        # 2 w x v + w x (w x p), of w along z
        turning = np.array([2.0 * (-w * vy) - w * (w * x), 2.0 * (w * vx) - w * (w * y), 0.0])
        return np.concatenate([s[3:], gravity(s[:3]) - turning])

    state = np.array([*place, *velocity], dtype=np.float64)
    points = [state[:3]]
    for h in np.diff(t):
        k1 = rate(state)
        k2 = rate(state + h / 2.0 * k1)
        k3 = rate(state + h / 2.0 * k2)
        k4 = rate(state + h * k3)
        state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        points.append(state[:3])
    return np.array(points)


def straight(
    site: Sequence[float], start: Sequence[float], velocity: Sequence[float], t: FloatArray
) -> FloatArray:
    """Positions (n, 3) on a line given in east, north, up [m, m/s] of a site."""
    longitude, latitude, height = site
    e, n, u = np.array(start)[:, None] + np.array(velocity)[:, None] * t
    return np.stack(pymap3d.enu2ecef(e, n, u, latitude, longitude, height), axis=1)


#: Flights by name: the paper's missile; an aircraft at 11 km that crosses the line between the
#: radars; a fast one at 24 km that passes close to the zenith of radar 1.
FLIGHTS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "printed": partial(ballistic, (-2664e3, 5350e3, 2870e3), (1700.0, 104.0, 1100.0)),
    "crossing": partial(straight, SITES[0], (-1.3e5, 3e4, 11e3), (620.0, 140.0, 4.0)),
    "overhead": partial(straight, SITES[0], (-6e4, 4e4, 24e3), (900.0, -580.0, 0.0)),
}


def flight(name: str, t: FloatArray) -> FloatArray:
    """Positions (n, 3) [m] of one of `FLIGHTS` at times (n,) [s].

    `InputError`: no such flight; it ends below the ground.
    """
    require_choice("flight", name, FLIGHTS)
    place = FLIGHTS[name](t)
    height = pymap3d.ecef2geodetic(*place.T)[2]
    found = f"{height.min():.0f} m at {t[int(np.argmax(height < 0.0))]:.1f} s"
    wanted = "a target above the ground"
    require(bool(height.min() >= 0.0), f"flight {name}", wanted, found, "end sooner")
    return place


# -- what radars see of it ------------------------------------------------------------------------


def seen_from(site: Sequence[float], place: FloatArray) -> FloatArray:
    """Range, elevation, azimuth (..., 3) [m, rad] of earth-fixed positions (..., 3)."""
    longitude, latitude, height = site
    e, n, u = pymap3d.ecef2enu(*np.moveaxis(place, -1, 0), latitude, longitude, height)
    distance = np.sqrt(e * e + n * n + u * u)
    return np.stack([distance, np.arcsin(u / distance), np.arctan2(e, n)], axis=-1)


def placed(site: Sequence[float], seen: FloatArray) -> FloatArray:
    """Earth-fixed positions of ranges, elevations, azimuths; see `seen_from`."""
    longitude, latitude, height = site
    r, e, n = np.moveaxis(seen, -1, 0)
    local = r * np.cos(e) * np.sin(n), r * np.cos(e) * np.cos(n), r * np.sin(e)
    return np.stack(pymap3d.enu2ecef(*local, latitude, longitude, height), axis=-1)


# -- the Cramer-Rao bound of two radars' biases from one target -----------------------------------


def jacobian(site: Sequence[float], seen: FloatArray) -> FloatArray:
    """dX/d(rho, e, n) (n, 3, 3), earth-fixed, at ranges, elevations, azimuths (n, 3)."""
    longitude, latitude, _ = site
    r, e, n = seen.T
    ce, se, cn, sn, zero = np.cos(e), np.sin(e), np.cos(n), np.sin(n), np.zeros_like(r)
    along = [ce * sn, ce * cn, se]
    up = [-r * se * sn, -r * se * cn, r * ce]
    local = np.array([along, up, [r * ce * cn, -r * ce * sn, zero]]).transpose(2, 1, 0)
    axes = np.stack([pymap3d.enu2uvw(*unit, latitude, longitude) for unit in np.eye(3)], axis=1)
    return np.asarray(axes @ local)


def information(jacobians: Sequence[FloatArray], noise: FloatArray) -> FloatArray:
    """Information of the records up to each about the six biases, (n, 6, 6): sum of H^T R^-1 H.

    With H = [J_1, -J_2] and R = H diag(noise)^2 H^T, the target being unknown.
    """
    h = np.concatenate([jacobians[0], -jacobians[1]], axis=2)
    r = h @ np.diag(noise**2) @ h.transpose(0, 2, 1)
    each = h.transpose(0, 2, 1) @ np.linalg.solve(r, h)
    return np.asarray(np.cumsum(each, axis=0))


def covariances(
    jacobians: Sequence[FloatArray], noise: FloatArray, prior: FloatArray
) -> FloatArray:
    """Least covariance (n, 6, 6) after each record of biases known before to ``prior`` (6,).

    Infinite ``prior``: nothing is known. Where the biases are not determined, infinite.
    """
    # In units of the noise, where the matrices are near one.
    total = information(jacobians, noise) * np.outer(noise, noise) + np.diag((noise / prior) ** 2)
    values, vectors = np.linalg.eigh(total)
    determined = values[:, :1] > 1e-13 * values[:, -1:]
    inverse = np.where(determined, 1.0 / np.where(determined, values, 1.0), np.inf)
    with np.errstate(invalid="ignore"):
        scaled = np.einsum("nij,nj,nkj->nik", vectors, inverse, vectors) * np.outer(noise, noise)
    return np.asarray(np.where(determined[:, :, None], scaled, np.inf))


def deviations(p: FloatArray) -> FloatArray:
    """Standard deviations (n, k) of covariances (n, k, k)."""
    return np.asarray(np.sqrt(np.einsum("nii->ni", p)))


# -- the world -------------------------------------------------------------------------------------


class TwoRadars(World):
    """Two radars and a target, ``TwoRadars("crossing", seed=3, missed=0.1)``.

    * ``on``: one of `FLIGHTS`; ``seed`` of noise, missed samples and drawn biases;
    * ``seconds``, ``dt``: length, and time between records [s];
    * ``bias``, ``noises``: range, elevation, azimuth of radar 1, then of radar 2 [m, deg];
      ``noise`` is a factor on the latter;
    * ``drawn``: standard deviations [m, deg] from which each draw has biases, in place of ``bias``;
    * ``missed``: share of its samples that each radar misses;
    * ``sites``: longitude, latitude, height [deg, deg, m] of both.

    `InputError`: an argument that no such world has; a target that hits the ground.
    """

    name = "two_radars"

    def __init__(
        self,
        on: str = "printed",
        seed: int = 1,
        noise: float = 1.0,
        *,
        seconds: float = 80.0,
        dt: float = 0.1,
        bias: Sequence[float] = BIAS,
        noises: Sequence[float] = NOISE,
        drawn: tuple[float, float] | None = None,
        missed: float = 0.0,
        sites: Sequence[Sequence[float]] = SITES,
    ) -> None:
        for valid, where, wanted, found in (
            (0.01 <= dt < 1.0, "dt", "0.01 to 1 s", dt),
            (dt <= seconds <= 1000.0, "seconds", "dt to 1,000 s", seconds),
            (noise >= 0.0, "noise", "0 or more", noise),
            (0.0 <= missed < 1.0, "missed", "a share below 1", missed),
            (len(bias) == len(noises) == 6, "bias and noises", "six numbers each", bias),
            (len(sites) == 2, "sites", "two radars", sites),
        ):
            require(valid, f"two_radars, {where}", wanted, found)
        self.sites, self.dt, self.missed, self.drawn = sites, dt, missed, drawn
        self.noises, self.nominal_bias = noise * np.array(noises) * _UNITS, np.array(bias) * _UNITS
        self.place = flight(on, dt * np.arange(round(seconds / dt) + 1.0))
        self.seen = [seen_from(site, self.place) for site in sites]
        self.draw(seed)

    def draw(self, seed: int) -> None:
        self.seed = seed
        self.start()

    def start(self) -> None:
        rng = np.random.default_rng([self.seed, 2014])
        n = len(self.place)
        white, luck, draw = rng.normal(size=(2, n, 3)), rng.random((2, n)), rng.normal(size=6)
        self.bias = self.nominal_bias
        if self.drawn is not None:
            spread = np.array([self.drawn[0], self.drawn[1], self.drawn[1]] * 2)
            self.bias = draw * spread * _UNITS
        self.reported = np.empty((2, n, 3))
        for i, (site, seen) in enumerate(zip(self.sites, self.seen, strict=True)):
            block = slice(3 * i, 3 * i + 3)
            measured = seen + self.bias[block] + self.noises[block] * white[i]
            self.reported[i] = placed(site, measured)
        luck[:, 0] = 1.0  # both begin with a sample
        self.reported[luck < self.missed] = np.nan
        self._k = 0

    def record(self, outputs: Mapping[str, float] | None) -> Mapping[str, float] | None:
        k = self._k
        if k >= len(self.place):
            return None
        self._k += 1
        data = {"dt": self.dt if k else -self.dt}
        for i, reported in enumerate(self.reported[:, k].tolist()):
            for axis, value, true in zip("xyz", reported, self.place[k].tolist(), strict=True):
                data |= {f"{axis}{i + 1}": value, f"{axis}{i + 1}_corrected_true": true}
        data |= {f"{b}_bias_true": float(v) for b, v in zip(BIASES, self.bias, strict=True)}
        return data

    def jacobians(self) -> list[FloatArray]:
        """dX/d(rho, e, n) (n, 3, 3) of both radars at the true target."""
        return [jacobian(site, seen) for site, seen in zip(self.sites, self.seen, strict=True)]

    def bound(self) -> dict[str, FloatArray]:
        """See `World`: of the biases, their prior being ``drawn``; none without."""
        prior = np.full(6, np.inf)
        if self.drawn is not None:
            prior = np.array([self.drawn[0], self.drawn[1], self.drawn[1]] * 2) * _UNITS
        noise = np.where(self.noises > 0.0, self.noises, 1e-9)
        sd = deviations(covariances(self.jacobians(), noise, prior))
        return {f"{b}_bias": sd[:, k] for k, b in enumerate(BIASES)}
