"""Programs that stand before the filters: from raw counts to the filters' input words, by name.

They are estimators without states: written once, run in float64, in integers, in C and on the core.
"""

from __future__ import annotations

from boresight.model.attitude.front.compass_field import CompassField
from boresight.model.attitude.front.field import CalibrateField
from boresight.model.attitude.front.inertial import CalibrateInertial
from boresight.model.estimator import Estimator

__all__ = ["FRONT", "CalibrateField", "CalibrateInertial", "CompassField"]

FRONT: dict[str, type[Estimator]] = {
    e.name: e for e in (CalibrateInertial, CalibrateField, CompassField)
}
