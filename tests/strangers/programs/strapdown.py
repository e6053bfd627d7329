"""Attitude by integrating a gyro: quaternion propagation of second order."""

from boresight import Estimator, Input, Output, State, ops

Q = ("qw", "qx", "qy", "qz")


class Strapdown(Estimator):
    """Half-angle rotation of each sample, renormalised by one Newton step."""

    inputs = tuple(Input(f"d{a}", -0.125, 0.125, "rad") for a in "xyz")
    states = tuple(State(n, -1.0, 1.0, initial=float(n == "qw")) for n in Q)
    outputs = tuple(Output(n, tolerance=1e-4) for n in Q)

    def step(self, x, u, p):
        """Rotate by the increment, then pull the length back to one."""
        w, a, b, c = x.qw, x.qx, x.qy, x.qz
        dx, dy, dz = 0.5 * u.dx, 0.5 * u.dy, 0.5 * u.dz
        half = 1.0 - 0.5 * (dx * dx + dy * dy + dz * dz)
        q = (
            w * half - a * dx - b * dy - c * dz,
            a * half + w * dx + b * dz - c * dy,
            b * half + w * dy + c * dx - a * dz,
            c * half + w * dz + a * dy - b * dx,
        )
        q = [ops.bounded(v, -1.01, 1.01, "a rotation keeps the length") for v in q]
        length = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
        newton = ops.bounded(1.5 - 0.5 * length, 0.9, 1.1, "length near one")
        q = [ops.clip(v * newton, -1.0, 1.0) for v in q]
        after = dict(zip(Q, q, strict=True))
        return after, after
