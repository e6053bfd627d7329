"""A cell: temperature of a thermistor, resistance of the warmth, voltage of what is left in it."""

from boresight import Estimator, Input, Output, State, blocks, ops

#: Share that is left, and the voltage then with no load.
LEFT = (0.0, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0)
VOLTS = (2.8, 3.28, 3.42, 3.53, 3.61, 3.74, 3.92, 4.05, 4.18)
#: scipy.signal.butter(2, 0.1, output="sos")
SMOOTH = blocks.Cascade.of(
    [[0.020083365564211225, 0.04016673112842245, 0.020083365564211225,
      1.0, -1.5610180758007182, 0.6413515380575631]], largest=16.0
)  # fmt: skip
WINDOW = blocks.MovingSum(4, -16.0, 16.0)


class Battery(Estimator):
    """Coulombs counted, and what follows from them."""

    inputs = (Input("ohms", 500.0, 200e3, "ohm"), Input("current", -16.0, 16.0, "A"))
    states = (
        State("left", 0.0, 1.0, "", 0.5),
        *SMOOTH.states("smooth", "A"),
        *WINDOW.states("window", "A"),
    )
    outputs = (
        Output("celsius", "K", tolerance=1e-4),
        Output("volts", "V", tolerance=1e-6),
        Output("mean", "A", tolerance=1e-7),
        Output("fan", "", tolerance=1e-6),
    )

    def step(self, x, u, p):
        """A tenth of a second."""
        kelvin = 1.0 / (1.0 / 298.15 + (1.0 / 3435.0) * (ops.log(u.ohms) - ops.log(1e4)))
        inner = 0.02 * ops.exp(ops.clip(-0.03 * (kelvin - 298.15), -2.0, 3.0))
        left = ops.clip(x.left + (0.1 / 3600.0 / 2.0) * u.current, 0.0, 1.0)
        smooth, drawn = SMOOTH.step("smooth", x, u.current)
        window, total = WINDOW.step("window", x, u.current)
        volts = blocks.interpolated(left, LEFT, VOLTS) + inner * drawn
        fan = 0.5 + 0.5 * ops.tanh(0.2 * (kelvin - 303.15))
        after = {"left": left, **smooth, **window}
        outputs = {"celsius": kelvin - 273.15, "volts": volts, "mean": 0.25 * total, "fan": fan}
        return after, outputs
