"""Float64: numpy as written, compiled C, and how near they are."""

from typing import Any

import numpy as np
import pytest

from boresight.firmware.floating import FloatCModel
from boresight.model.attitude import ESTIMATORS, estimator
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.nine_axis import INPUTS
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import CompiledFloat, NumpyFloat
from boresight.sim.records.feed import feed, fitted
from boresight.sim.records.files import bundled, read_record
from tests.support.compiled_float import numpy_float


@pytest.mark.parametrize("log", ["ximu_walk", "synthetic_60s"])
@pytest.mark.parametrize("name", sorted(n for n, e in ESTIMATORS.items() if e.inputs == INPUTS))
def test_compiled_float64_is_the_reference_within_rounding(name: str, log: str) -> None:
    record = read_record(bundled(log)).head(60)
    made = fitted(estimator(name), record)
    records = feed(made, record).inputs
    reference = numpy_float(made, records[:, :, None])
    result = CompiledFloat(Build(made)).run(records).outputs
    assert list(result) == [o.name for o in made.outputs]
    for o in made.outputs:
        assert result[o.name].dtype == np.float64
        error = np.abs(result[o.name] - reference[o.name][:, 0])
        if o.unit == "ht":
            error = np.abs((error + 1.0) % 2.0 - 1.0)
        assert error.max() <= 1e-12, o.name


def test_numpy_is_the_reference() -> None:
    records = feed(estimator("complementary"), read_record(bundled("ximu_walk")).head(40)).inputs
    result = NumpyFloat(Build(estimator("complementary")))
    reference = numpy_float(estimator("complementary"), records[:, :, None])
    for name, values in result.run(records).outputs.items():
        assert np.array_equal(values, reference[name][:, 0])
    with pytest.raises(ValueError, match="shorter"):
        result.step(records[0, :-1])


class Third(Estimator):
    """What single precision does not hold."""

    inputs = (Input("z", 0.0, 4.0, ""),)
    params = (Param("k", 1.0 / 3.0, 0.0, 1.0),)
    states = (State("x", -9.0, 9.0, "", 0.1),)
    outputs = (Output("y"), Output("sum"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        total = x.x + p.k * u.z
        return {"x": total}, {"y": 0.7 * u.z, "sum": total}


def test_double_precision_throughout() -> None:
    z, k = 1.1, 0.3
    level = CompiledFloat(Build(Third(), params=[{"k": k}]))
    assert level.step(np.array([z])).outputs == {"y": 0.7 * z, "sum": 0.1 + k * z}
    level.reset()  # keeps the parameters
    assert level.step(np.array([z])).outputs["sum"] == 0.1 + k * z
    assert CompiledFloat(Build(Third())).step(np.array([z])).outputs["sum"] == 0.1 + z * (1.0 / 3.0)
    with pytest.raises(ValueError, match=r"^inputs must have shape \(n, 1\), not \(3, 2\)$"):
        FloatCModel(Third()).update(np.zeros((3, 2)))
