"""Moving average of a thermometer over as many samples as one likes."""

from boresight import Estimator, Input, Output, State


class Fir(Estimator):
    """Mean of the last ``taps`` samples."""

    def __init__(self, taps=8):
        self.taps = taps
        self.inputs = (Input("temperature", -55.0, 125.0, "degC"),)
        self.states = tuple(
            State(f"z{k}", -55.0, 125.0, "degC", initial=20.0) for k in range(1, taps)
        )
        self.outputs = (
            Output("mean", "degC", tolerance=1e-5),
            Output("swing", "delta_degC", tolerance=1e-6, meaning="newest less oldest"),
        )

    def step(self, x, u, p):
        """Shift and add."""
        line = [u.temperature, *(getattr(x, f"z{k}") for k in range(1, self.taps))]
        total = line[0]
        for value in line[1:]:
            total = total + value
        after = {f"z{k + 1}": value for k, value in enumerate(line[:-1])}
        return after, {"mean": total / self.taps, "swing": line[0] - line[-1]}
