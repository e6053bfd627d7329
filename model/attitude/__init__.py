"""The attitude filters, by name; the estimators of `systems/` are found by entry points."""

from __future__ import annotations

from boresight.model.attitude.complementary import Complementary
from boresight.model.attitude.ekf_bias import EkfBias
from boresight.model.attitude.ekf_quaternion import EkfQuaternion
from boresight.model.attitude.ma2014 import Ma2014Cf
from boresight.model.attitude.mekf import Mekf
from boresight.model.attitude.vqf import Vqf
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of as estimator

__all__ = ["ESTIMATORS", "FILTERS", "estimator"]

ESTIMATORS: dict[str, type[Estimator]] = {
    e.name: e for e in (Complementary, EkfBias, EkfQuaternion, Ma2014Cf, Mekf, Vqf)
}

#: Filters of the complete system, in the order of their numbers: what `make` builds and measures.
FILTERS = ("complementary", "ekf_quaternion", "ekf_bias", "mekf")
