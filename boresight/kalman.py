"""Kalman filters from their model: states, motion, measurements. See `docs/learn/kalman.md`."""

from boresight.model.kalman.declared import Attitude, Measurement, State, vector
from boresight.model.kalman.kalman import Kalman
from boresight.model.kalman.linear import linear
from boresight.model.kalman.textbook import Textbook

__all__ = ["Attitude", "Kalman", "Measurement", "State", "Textbook", "linear", "vector"]
