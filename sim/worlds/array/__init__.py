"""An array that turns on a vertical axis: its attitude unit, and what tells its azimuth."""
