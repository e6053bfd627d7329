"""Range and closing speed of a target that the radar sometimes misses."""

from boresight import Estimator, Input, Output, Param, State, ops


class AlphaBeta(Estimator):
    """Tracks on where there is no detection, and counts how long."""

    inputs = (
        Input("dt", 0.0, 0.25, "s"),
        Input("range", 0.0, 2000.0, "m", missing="hold"),
        Input("seen", 0.0, 1.0, "", valid_of="range"),
    )
    params = (
        Param("alpha", 0.4, 0.0, 1.0, "", "share of the innovation in the range"),
        Param("beta", 0.1, 0.0, 1.0, "", "share of it in the speed"),
    )
    states = (
        State("range", -100.0, 2100.0, "m", initial=1000.0),
        State("speed", -200.0, 200.0, "m/s"),
        State("since", 0.0, 60.0, "s"),
    )
    outputs = (
        Output("track", "m", tolerance=1e-3),
        Output("speed", "m/s", tolerance=1e-3),
        Output("since", "s", tolerance=1e-5),
        Output("flags", "flags", meaning="bit 0: no detection for half a second"),
    )

    def step(self, x, u, p):
        """Predict; correct where something was seen."""
        seen = u.seen > 0.5
        ahead = x.range + u.dt * x.speed
        innovation = ops.where(seen, u.range - ahead, 0.0)
        track = ahead + p.alpha * innovation
        speed = x.speed + p.beta * (innovation / ops.clip(u.dt, 0.02, 0.25))
        speed = ops.clip(speed, -200.0, 200.0)
        since = ops.clip(ops.where(seen, 0.0, x.since + u.dt), 0.0, 60.0)
        lost = ops.where(since > 0.5, 1.0, 0.0)
        after = {"range": ops.clip(track, -100.0, 2100.0), "speed": speed, "since": since}
        return after, {"track": after["range"], "speed": speed, "since": since, "flags": lost}
