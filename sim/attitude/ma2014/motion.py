"""Motions of three stacked rotary stages, exact at every instant.

Stages x (lowest), y and z (top) turn by the angles a, b, c, so the sensors on top have the attitude

    C_bn = Rx(a) Ry(b) Rz(c).

A `Swing` moves one stage; a `StackedMotion` is a list of swings, one after the other. Between its
swings a stage stands where it was left. Angles are sines of time, so rates and accelerations are
closed forms; no number here comes from differences.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError
from boresight.sim.rotations.rotation import matrix_to_quaternion

__all__ = ["Swing", "StackedMotion"]


@dataclass(frozen=True)
class Swing:
    """One stage swings: ``amplitude sin(phase + 2 pi t / period)`` for so many periods.

    ``axis`` is the stage, 0 to 2; ``amplitude`` [rad] has either sign; ``period`` [s] and
    ``periods``, which need not be whole, are above 0; ``phase`` [rad] 0 starts in the middle, pi/2
    at the end of the swing. `InputError` if a value is out of its range.
    """

    axis: int
    amplitude: float
    period: float
    periods: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        if self.axis not in (0, 1, 2):
            raise InputError(f"axis must be 0, 1 or 2, not {self.axis!r}")
        for name in ("amplitude", "period", "periods", "phase"):
            value = getattr(self, name)
            above = " above 0" if name.startswith("period") else ""
            if not math.isfinite(value) or (above and value <= 0.0):
                raise InputError(f"{name} must be a finite number{above}, not {value!r}")

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return self.period * self.periods

    def at(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Angle [rad], rate [rad/s] and acceleration [rad/s^2] at times t since its start [s]."""
        w = 2.0 * math.pi / self.period
        sine, cosine = np.sin(self.phase + w * t), np.cos(self.phase + w * t)
        return (self.amplitude * sine, self.amplitude * w * cosine, -self.amplitude * w * w * sine)


@dataclass(frozen=True)
class StackedMotion:
    """Swings of stacked stages, one after the other, beginning at t = 0.

    Before the first swing and after the last the stages stand still. Where one swing follows
    another, the rate may jump; the instant itself belongs to the later one.

    Raises
    ------
    InputError
        If there is none, or a stage would jump: a swing must begin at the angle at which the last
        one of its stage ended (the first one of a stage: where it likes).
    """

    swings: Sequence[Swing]

    def __post_init__(self) -> None:
        if not self.swings:
            raise InputError("swings must have at least one entry, not none")
        end_angles: dict[int, float] = {}
        for k, swing in enumerate(self.swings):
            start = float(swing.at(np.zeros(1))[0][0])
            if abs(start - end_angles.get(swing.axis, start)) > 1e-9:
                raise InputError(
                    f"swing {k} must start at {math.degrees(end_angles[swing.axis]):g} deg, "
                    f"where its stage stands, not {math.degrees(start):g} deg"
                )
            end_angles[swing.axis] = float(swing.at(np.array([swing.seconds]))[0][0])

    @property
    def seconds(self) -> float:
        """How long all swings take."""
        return sum(swing.seconds for swing in self.swings)

    @property
    def ends(self) -> FloatArray:
        """Stage angles a, b, c [rad] at the end of each swing, (n_swings, 3)."""
        times = np.cumsum([swing.seconds for swing in self.swings])
        return np.array([self._before(float(t))[0] for t in times])

    def _before(self, t: float) -> FloatArray:
        """Angles, rates and accelerations just before ``t``: (3, 3)."""
        return np.stack(self.stages(np.array([np.nextafter(t, 0.0)])))[:, 0]

    def stages(self, t: npt.ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Stage angles [rad], rates [rad/s] and accelerations [rad/s^2] at times t [s]: (n, 3)."""
        t = np.asarray(t, dtype=np.float64)
        out = np.zeros((3, len(t), 3))
        started: set[int] = set()
        start = 0.0
        for swing in self.swings:
            end = start + swing.seconds
            if swing.axis not in started:  # until its first swing the stage stands at its start
                started.add(swing.axis)
                out[0, :, swing.axis] = swing.at(np.zeros(1))[0]
            moving, ended = (t >= start) & (t < end), t >= end
            for row, value in zip(out, swing.at(t[moving] - start), strict=True):
                row[moving, swing.axis] = value
            out[0, ended, swing.axis] = swing.at(np.array([swing.seconds]))[0]
            start = end
        return out[0], out[1], out[2]

    def matrix(self, t: npt.ArrayLike) -> FloatArray:
        """Attitude ``C_bn = Rx(a) Ry(b) Rz(c)`` at times t [s]: (n, 3, 3)."""
        angles, _, _ = self.stages(t)
        rx, ry, rz = (_turn(k, angles[:, k]) for k in range(3))
        return np.asarray(rx @ ry @ rz)

    def attitude(self, t: npt.ArrayLike) -> FloatArray:
        """The same as quaternions, (n, 4)."""
        return matrix_to_quaternion(self.matrix(t))

    def rates(self, t: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Body rate w [rad/s] and its derivative [rad/s^2] at times t [s]: (n, 3) each.

        ::

            u = Ry(b)^T x a' + y b'         u' = Ry^T x a'' - b' y x (Ry^T x a') + y b''
            w = Rz(c)^T u + z c'            w' = Rz^T u' - c' z x (Rz^T u) + z c''
        """
        angles, first, second = self.stages(t)
        x, y, z = np.eye(3)
        ry_t, rz_t = (np.swapaxes(_turn(k, angles[:, k]), 1, 2) for k in (1, 2))
        (a1, b1, c1), (a2, b2, c2) = (np.moveaxis(d, 1, 0)[:, :, None] for d in (first, second))
        x_axis = ry_t @ x  # (n, 3): the axis of stage x, seen from stage y
        u = x_axis * a1 + y * b1
        u_dot = x_axis * a2 - b1 * np.cross(y, x_axis * a1) + y * b2
        u_top = _apply(rz_t, u)
        w = u_top + z * c1
        w_dot = _apply(rz_t, u_dot) - c1 * np.cross(z, u_top) + z * c2
        return w, w_dot

    def specific_force(
        self, t: npt.ArrayLike, *, gravity: float, lever: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> FloatArray:
        """Specific force of an ideal accelerometer [m/s^2] at times t [s]: (n, 3).

        Parameters
        ----------
        gravity : float
            [m/s^2]
        lever : three floats
            Place of the accelerometer [m] in body axes; the axes of the stages meet at 0:
            ``f = C^T (0, 0, g) + w' x r + w x (w x r)``.
        """
        w, w_dot = self.rates(t)
        r = np.broadcast_to(np.asarray(lever, dtype=np.float64), w.shape)
        up = self.matrix(t)[:, 2, :]  # C^T z
        return np.asarray(gravity * up + np.cross(w_dot, r) + np.cross(w, np.cross(w, r)))


def _apply(c: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("nij,nj->ni", c, v))


def _turn(axis: int, angle: FloatArray) -> FloatArray:
    """Turn by ``angle`` about a coordinate axis: (n, 3, 3)."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    c = np.zeros((len(angle), 3, 3))
    c[:, axis, axis] = 1.0
    c[:, i, i] = c[:, j, j] = np.cos(angle)
    c[:, j, i] = np.sin(angle)
    c[:, i, j] = -c[:, j, i]
    return c
