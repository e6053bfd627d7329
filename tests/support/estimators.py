"""Every estimator that a verb finds by name: the toolkit's and those of `systems/`."""

from __future__ import annotations

from boresight.model.estimator import Estimator
from boresight.model.estimators import ESTIMATORS
from boresight.model.resolve import ESTIMATOR_GROUP, offered

ALL, _UNUSABLE = offered(Estimator, "estimator", ESTIMATORS, ESTIMATOR_GROUP)
assert not _UNUSABLE
