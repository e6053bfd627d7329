"""The equations of EKF2's published derivation in numpy, written without the builder.

Error states in the order attitude (navigation axes), velocity, position, gyro bias, accelerometer
bias, earth field, body field, wind (north, east), terrain.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

DT, EPSILON = 0.01, 0.125
GRAVITY = np.array([0.0, 0.0, 9.80665])
THETA, V, P, BG, BA, MI, MB = (slice(3 * k, 3 * k + 3) for k in range(7))
WIND, TERRAIN = slice(21, 23), 23


def cross(a: FloatArray) -> FloatArray:
    """[a x]."""
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def matrix(q: FloatArray) -> FloatArray:
    """C, body to navigation, of a unit quaternion, scalar first."""
    w, u = q[0], q[1:]
    out: FloatArray = (w * w - u @ u) * np.eye(3) + 2.0 * np.outer(u, u) + 2.0 * w * cross(u)
    return out


def times(a: FloatArray, b: FloatArray) -> FloatArray:
    """Product of two quaternions."""
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.array([w, *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


def unit(q: FloatArray) -> FloatArray:
    out: FloatArray = q / np.linalg.norm(q)
    return out


class Book:
    """State and covariance."""

    def __init__(self, q: FloatArray, x: FloatArray, cov: FloatArray) -> None:
        #: The quaternion; the other states from index 3 on, as the errors.
        self.q, self.x, self.cov = q, x.copy(), cov.copy()

    def predict(self, gyro: FloatArray, force: FloatArray, noise: FloatArray) -> None:
        """Strapdown, A P A^T + G Q G^T, walks on the diagonal."""
        c, x = matrix(self.q), self.x
        f = c @ (force - x[BA])
        a = np.eye(24)
        a[THETA, BG] = -DT * c
        a[V, THETA], a[V, BA] = -DT * cross(f), -DT * c
        a[P, V] = DT * np.eye(3)
        g = np.zeros((24, 24))
        g[:3, :3] = g[V, V] = c
        g[9:, 9:] = np.eye(15)
        self.cov = a @ self.cov @ a.T + g @ np.diag(noise) @ g.T
        turn = DT * (gyro - x[BG])
        angle = np.linalg.norm(turn)
        half = np.array([np.cos(0.5 * angle), *(np.sin(0.5 * angle) / angle * turn)])
        self.q = unit(times(self.q, half))
        x[P] = x[P] + DT * x[V]
        x[V] = x[V] + DT * (f + GRAVITY)

    def row(
        self, kind: str, axis: FloatArray, z: float, drag: float, rotor: float
    ) -> tuple[Any, FloatArray]:
        """Innovation in SI units and gauss, and H."""
        c, x, h = matrix(self.q), self.x, np.zeros(24)
        k, v = c @ axis, x[V]
        air = v - np.array([*x[WIND], 0.0])
        speed = np.sqrt(air @ air + EPSILON**2)
        above = x[TERRAIN] - x[8]

        def of_velocity(w: FloatArray, along: FloatArray, factor: float) -> None:
            """H of factor (C axis) . w: (e x k) . w = e . (k x w)."""
            h[THETA] += factor * np.cross(along, w)
            h[V] += factor * along

        if kind == "velocity":
            h[V] = axis
            return z - axis @ v, h
        if kind == "position":
            h[P] = axis
            return z - axis @ x[P], h
        if kind == "range":
            h[TERRAIN], h[8] = 1.0, -1.0
            return z - above, h
        if kind == "heading":
            h[2] = 1.0
            turn = z - np.arctan2(c[1, 0], c[0, 0])
            return (turn + np.pi) % (2.0 * np.pi) - np.pi, h
        if kind == "airspeed":
            h[V], h[WIND] = air / speed, -air[:2] / speed
            return z - speed, h
        if kind == "field":
            h[THETA], h[MI], h[MB] = np.cross(k, x[MI]), k, axis
            return z - (k @ x[MI] + axis @ x[MB]), h
        if kind == "declination":
            north, east, _ = x[MI]
            h[15], h[16] = -east / (north**2 + east**2), north / (north**2 + east**2)
            return z - np.arctan2(east, north), h
        if kind == "sideslip":
            ahead, across = c[:, 0] @ air, c[:, 1] @ air
            square = ahead**2 + across**2
            of_velocity(air, c[:, 1], ahead / square)
            of_velocity(air, c[:, 0], -across / square)
            h[WIND] = -h[V][:2]
            return z - np.arctan2(across, ahead), h
        if kind == "drag":
            along, factor = k @ air, drag * speed + rotor
            of_velocity(air, k, -factor)
            h[V] -= drag * along * air / speed
            h[WIND] = -h[V][:2]
            return z + factor * along, h
        if kind == "flow":
            along, upright = k @ v, c[2, 2]
            of_velocity(v, k, upright / above)
            # e x (C z), its component down
            h[THETA] += along / above * np.array([c[1, 2], -c[0, 2], 0.0])
            h[TERRAIN], h[8] = -along * upright / above**2, along * upright / above**2
            return z - along * upright / above, h
        if kind == "body_velocity":
            of_velocity(v, k, 1.0)
            return z - k @ v, h
        assert kind == "gravity"
        down = np.array([0.0, 0.0, -1.0])
        h[THETA] = np.cross(k, down)
        return z - k @ down, h

    def update(self, innovation: float, h: FloatArray, r: float) -> None:
        """Gain, correction, Joseph's form."""
        gain = self.cov @ h / (h @ self.cov @ h + r)
        left = np.eye(24) - np.outer(gain, h)
        self.cov = left @ self.cov @ left.T + r * np.outer(gain, gain)
        moved = gain * innovation
        self.q = unit(times(np.array([1.0, *(0.5 * moved[THETA])]), self.q))
        self.x[3:] += moved[3:]
