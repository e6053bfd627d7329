"""Attitude of an array that turns for hours: strapdown, zero velocity, azimuth index."""
