"""VQF, the versatile quaternion-based filter of Laidig and Seel (2023)."""

from __future__ import annotations

from boresight.model.attitude.vqf.filter import Vqf

__all__ = ["Vqf"]
