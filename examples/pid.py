"""Position control of a servo axis: PID with anti-windup, and a notch for its resonance.

After Åström and Hägglund, Advanced PID Control (2006), chapters 3 and 13: the derivative acts on
the filtered measurement, and the integral is corrected by what the limit took from the drive. The
notch is `scipy.signal.iirnotch(50, 2, fs=1000)`.
"""

from boresight import Estimator, Input, Output, Param, State, ops

DT, SUPPLY = 1e-3, 12.0  # s, V
NUMERATOR = (0.92704034, -1.7633355, 0.92704034)
DENOMINATOR = (1.0, -1.7633355, 0.85408069)


class Pid(Estimator):
    """One axis, 1 kHz."""

    inputs = (Input("target", -4.0, 4.0, "rad"), Input("angle", -8.0, 8.0, "rad"))
    params = (
        Param("kp", 12.0, 0.0, 64.0, "V/rad", "proportional"),
        Param("ki", 20.0, 0.0, 64.0, "V/(rad s)", "integral"),
        Param("kd", 0.8, 0.0, 4.0, "V s/rad", "derivative"),
        Param("track", 20.0, 0.0, 100.0, "1/s", "how fast the integral leaves a limit"),
    )
    states = (
        State("integral", -12.0, 12.0, "V"),
        State("slow", -8.0, 8.0, "rad"),
        State("n1", -16.0, 16.0, "V"),
        State("n2", -16.0, 16.0, "V"),
    )
    outputs = (Output("drive", "V", tolerance=1e-3),)

    def step(self, x, u, p):
        """One period; ``slow`` is the angle after a low-pass of 5 ms."""
        error, slow = u.target - u.angle, x.slow + 0.2 * (u.angle - x.slow)
        rate = ops.clip(200.0 * (u.angle - x.slow), -50.0, 50.0)
        wanted = ops.clip(p.kp * error + x.integral - p.kd * rate, -16.0, 16.0)
        (b0, b1, b2), (_, a1, a2) = NUMERATOR, DENOMINATOR
        notched = b0 * wanted + x.n1
        drive = ops.clip(notched, -SUPPLY, SUPPLY)
        integral = x.integral + DT * (p.ki * error + p.track * (drive - notched))
        after = {
            "integral": ops.clip(integral, -SUPPLY, SUPPLY),
            "slow": slow,
            "n1": b1 * wanted - a1 * notched + x.n2,
            "n2": b2 * wanted - a2 * notched,
        }
        return after, {"drive": drive}
