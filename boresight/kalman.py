"""Kalman filters from their model: states, motion, measurements. See `docs/learn/kalman.md`."""

from boresight.model.kalman import Attitude, Kalman, Measurement, State, Textbook, linear, vector

__all__ = ["Attitude", "Kalman", "Measurement", "State", "Textbook", "linear", "vector"]
