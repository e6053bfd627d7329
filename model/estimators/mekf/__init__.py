"""The flagship: a multiplicative extended Kalman filter of six error states."""

from __future__ import annotations

from boresight.model.estimators.mekf.filter import Mekf

__all__ = ["Mekf"]
