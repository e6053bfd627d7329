"""Where an antenna on a moving body must look: it reads the attitude that mekf keeps."""

from boresight import Estimator, Input, Output, ops


class Pointing(Estimator):
    """Azimuth and elevation, in body axes, of a satellite whose direction in the site is known."""

    inputs = (
        Input("east", -1.0, 1.0, ""),
        *(Input(f"q{a}", -1.0, 1.0, "", source=f"mekf.q{a}") for a in "wxyz"),
        Input("north", -1.0, 1.0, ""),
        Input("up", -1.0, 1.0, ""),
    )
    outputs = (
        Output("azimuth", "ht", tolerance=1e-4),
        Output("elevation", "ht", tolerance=1e-4),
        Output("facing", "", tolerance=1e-4, meaning="cosine of the angle to the body's x axis"),
    )

    def step(self, x, u, p):
        w, i, j, k = u.qw, u.qx, u.qy, u.qz
        e, n, z = u.east, u.north, u.up
        # Rows of the rotation from site (east, north, up) to body axes.
        along = (1.0 - 2.0 * (j * j + k * k)) * e + 2.0 * (i * j + k * w) * n
        right = 2.0 * (i * j - k * w) * e + (1.0 - 2.0 * (i * i + k * k)) * n
        over = 2.0 * (i * k + j * w) * e + 2.0 * (j * k - i * w) * n
        bx = ops.bounded(along + 2.0 * (i * k - j * w) * z, -1.75, 1.75, "a unit vector turned")
        by = ops.bounded(right + 2.0 * (j * k + i * w) * z, -1.75, 1.75, "a unit vector turned")
        bz = ops.bounded(
            over + (1.0 - 2.0 * (i * i + j * j)) * z, -1.75, 1.75, "a unit vector turned"
        )
        level = ops.sqrt(bx * bx + by * by)
        return {}, {
            "azimuth": ops.atan2_ht(by, bx),
            "elevation": ops.atan2_ht(bz, level),
            "facing": bx,
        }
