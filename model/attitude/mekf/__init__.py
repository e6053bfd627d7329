"""The flagship: a multiplicative extended Kalman filter of six error states."""

from __future__ import annotations

from boresight.model.attitude.mekf.filter import Mekf

__all__ = ["Mekf"]
