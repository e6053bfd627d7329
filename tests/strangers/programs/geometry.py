"""Where to look: azimuth, elevation and distance of a point, and its angle off the axis."""

from boresight import Estimator, Input, Output, ops


class Look(Estimator):
    """North, east, down to azimuth and elevation; no state."""

    inputs = tuple(Input(n, -1000.0, 1000.0, "m") for n in ("north", "east", "down"))
    outputs = (
        Output("azimuth", "ht", tolerance=2e-5),
        Output("elevation", "ht", tolerance=2e-5),
        Output("distance", "m", tolerance=2e-3),
        Output("dip", "ht", tolerance=2e-5, meaning="asin of |down| over distance, to 44 deg"),
    )

    def step(self, x, u, p):
        """Arc tangents, a root, an arc sine."""
        level = u.north * u.north + u.east * u.east
        horizontal = ops.sqrt(level)
        squared = level + u.down * u.down
        sine = ops.clip(ops.absolute(u.down) * ops.rsqrt(squared), 0.0, 0.7)
        return {}, {
            "azimuth": ops.atan2_ht(u.east, u.north),
            "elevation": ops.atan2_ht(-u.down, horizontal),
            "distance": ops.sqrt(squared),
            "dip": ops.asin_ht(sine),
        }
