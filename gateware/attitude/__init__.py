"""The attitude system of the 2014 paper: sensors, update controller, output, soft core."""
