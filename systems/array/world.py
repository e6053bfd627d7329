"""The array of Wang Wenzhe et al. (2016): aligned at rest, erected, then turned for eight hours."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from boresight import World
from boresight.model.arrays import FloatArray
from boresight.model.declarations import MICRO_G
from boresight.model.errors import require
from boresight.sim.rotations.rotation import euler_to_matrix, matrix_to_euler
from boresight.sim.rotations.zyx import wrapped
from boresight.systems.worlds import sensors
from boresight.systems.worlds.turning import Turn, Turning, earth_rate, normal_gravity
from boresight.systems.worlds.turntable import Mark, pulses

ANGLES = ("pitch", "roll", "heading")
DT = 0.01  #: s
ALIGNED, ERECTED = 30_000, 31_300  #: samples at the end of the alignment, of the erection.
START_DEG = (1.0, 2.0, 90.0)  #: pitch, roll, heading before the erection.
LATITUDE_DEG, HEIGHT = 31.9521, 45.0
#: The paper's constant errors, bias, scale, misalignment: of gyros 0.003 deg/h, 1e-5, 20e-6, of
#: accelerometers 20 ug, 1e-4, 20e-6.
ERRORS = np.array([[0.003 * sensors.PER_HOUR, 1e-5, 20e-6], [20.0 * MICRO_G, 1e-4, 20e-6]])
_PIECE = 20_000  #: records made at once.


class TurningArray(World):
    """An array on its turntable, ``TurningArray(36.0, seed=3, hours=0.1)``.

    * ``deg_s``: rate about the vertical, counter-clockwise, after alignment (300 s) and erection
      (13 s), for so many ``hours``; ``seed`` of the errors' signs, noise and pulses;
    * ``errors``: factor on the paper's errors (`ERRORS`), whose signs are drawn;
    * ``noise``: factor on the noise of a fibre-optic gyro and an accelerometer beside it, which the
      paper does not have (`sensors.FIBRE_OPTIC`);
    * ``tilt_deg``: pitch and roll at the start differ from `START_DEG` by this, the heading is any;
    * ``counts_bits``: increments are counts of 2^-7 rad and 2^-2 m/s over 2^(counts_bits - 1);
    * ``mark_deg``, ``index``, ``missed``, ``doubled``, ``wrong``: see `Mark`;
    * ``truths``: whether the records hold true angles, which take most of the time to make.

    `InputError`: a rate of 0 or more than 44 deg/s, no time, a size below 0, a tilt above 20 deg.
    """

    name = "turning_array"

    def __init__(
        self,
        deg_s: float = 0.35,
        seed: int = 1,
        *,
        hours: float = 8.0,
        errors: float = 1.0,
        noise: float = 0.0,
        tilt_deg: float = 0.0,
        counts_bits: int = 32,
        mark_deg: float = START_DEG[2],
        index: str = "hall",
        missed: float = 0.0,
        doubled: float = 0.0,
        wrong: float = 0.0,
        truths: bool = True,
    ) -> None:
        for valid, where, wanted, found in (
            (0.0 < deg_s <= 44.0, "deg_s", "above 0, to 44", deg_s),
            (0.0 < hours <= 100.0, "hours", "above 0, to 100", hours),
            (errors >= 0.0, "errors", "0 or more", errors),
            (noise >= 0.0, "noise", "0 or more", noise),
            (0.0 <= tilt_deg <= 20.0, "tilt_deg", "0 to 20", tilt_deg),
            (16 <= counts_bits <= 48, "counts_bits", "16 to 48", counts_bits),
        ):
            require(valid, f"turning_array, {where}", wanted, found)
        self.deg_s, self.errors, self.truths, self.tilt_deg = deg_s, errors, truths, tilt_deg
        self.mark = Mark(mark_deg, index, missed, doubled, wrong)
        full = (2.0**-7, 2.0**-2)
        self.noise = [
            sensors.Noise(noise * grade.white, noise * grade.walk, lsb * 2.0 ** (1 - counts_bits))
            for grade, lsb in zip((sensors.FIBRE_OPTIC, sensors.ACCELEROMETER), full, strict=True)
        ]
        self.samples = ERECTED + round(hours * 3600.0 / DT)
        self.draw(seed)

    def draw(self, seed: int) -> None:
        self.seed = seed
        signs, luck, tilts = (np.random.default_rng([seed, k]) for k in (0, 2, 3))
        off = signs.choice([-1.0, 1.0], 3)
        turn = 180.0 * tilts.random() if self.tilt_deg else 0.0
        angles = START_DEG + off * (self.tilt_deg, self.tilt_deg, turn)
        start = euler_to_matrix(np.radians(angles))
        roll, rate = math.radians(angles[1]), math.radians(self.deg_s)
        hinge = np.array([math.cos(roll), 0.0, math.sin(roll)])
        east, north, up = (math.radians(5.0) * start @ hinge).tolist()
        lengths = np.diff((0, ALIGNED, ERECTED, self.samples)).tolist()
        rates = (0.0, 0.0, 0.0), (east, north, up), (0.0, 0.0, rate)
        self.motion = Turning(
            start,
            [Turn(n, r) for n, r in zip(lengths, rates, strict=True)],
            DT,
            earth=earth_rate(LATITUDE_DEG),
            gravity=normal_gravity(LATITUDE_DEG, HEIGHT),
        )
        heading = float(matrix_to_euler(self.motion.starts[2])[2])
        self.pulses = pulses(self.mark, heading, rate, lengths[2], DT, luck)
        self.constant = [sensors.signed(signs, *(self.errors * e)) for e in ERRORS]

    def truth(self, first: int, last: int, every: int = 1) -> FloatArray:
        """Pitch, roll, heading (n, 3) [rad] at the ends of samples; see `Turning.matrix`."""
        return matrix_to_euler(self.motion.matrix(first, last, every))

    def pieces(self) -> Iterator[Mapping[str, FloatArray]]:
        """See `World`: first the record that restarts, then one of each sample."""
        triads = [
            sensors.Triad(*errors, noise, (self.seed, 2016, k), DT)
            for k, (errors, noise) in enumerate(zip(self.constant, self.noise, strict=True))
        ]
        restart = np.array([[*np.zeros(6), math.radians(self.mark.at_deg), 0.0, -1.0]])
        start = matrix_to_euler(self.motion.starts[0])[None]
        yield _columns(restart, start if self.truths else None)
        for first in range(0, self.samples, _PIECE):
            last = min(first + _PIECE, self.samples)
            table = np.full((last - first, 9), np.nan)
            true = self.motion.increments(first, last)
            for k, triad in enumerate(triads):
                table[:, 3 * k : 3 * k + 3] = triad.read(true[:, 3 * k : 3 * k + 3])
            span = slice(*np.searchsorted(self.pulses.sample + ERECTED, (first, last)))
            at = self.pulses.sample[span] + ERECTED - first
            table[at, 6], table[at, 7] = self.pulses.azimuth[span], self.pulses.share[span]
            table[:, 8] = np.searchsorted((ALIGNED, ERECTED), np.arange(first, last), side="right")
            yield _columns(table, self.truth(first, last) if self.truths else None)


def _columns(table: FloatArray, truth: FloatArray | None) -> dict[str, FloatArray]:
    """Columns of `array_attitude` (n, 9) by name, angles in half turns, with truths (n, 3)."""
    names = [f"{kind}_{axis}" for kind in ("dtheta", "dv") for axis in "xyz"]
    columns = dict(zip((*names, "azimuth", "index_time", "phase"), table.T, strict=True))
    columns["azimuth"] = wrapped(columns["azimuth"] / math.pi, 2.0)
    if truth is not None:
        columns |= {f"{n}_true": v for n, v in zip(ANGLES, truth.T / math.pi, strict=True)}
    return columns
