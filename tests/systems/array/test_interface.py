"""What `array_attitude` declares: names that others rely on, states that fit their units."""

from boresight.model.algebra import strapdown
from boresight.systems.array import interface
from boresight.systems.array.error_filter import FORCE, GYRO, SCALE
from boresight.systems.array.estimator import ArrayAttitude


def test_names_and_units() -> None:
    e = ArrayAttitude()
    e.check_declarations()
    assert [i.name for i in e.inputs][6:] == ["phase", "azimuth", "index_time", "index"]
    assert [o.name for o in e.outputs][:3] == ["pitch", "roll", "heading"] and e.urgent == 3
    units = {o.name: o.unit for o in e.outputs}
    assert units["eps_x"] == "rad/s" and units["nabla_z"] == "m/s^2" and units["status"] == "bits"
    assert e.inputs[-1].flags == ("azimuth", "index_time")
    assert len(e.states) <= 128 and len(ArrayAttitude(reading="literal").states) <= 128
    assert set(interface.STATUS_BITS) == set(range(8))


def test_every_kind_has_a_first_spread_within_its_unit() -> None:
    params = {p.name: p for p in ArrayAttitude().params}
    assert len(interface.KINDS) == 13 and set(interface.KINDS) == set(interface.UNITS)
    for kind, unit in interface.UNITS.items():
        p = params[f"p0_{kind}"]
        assert p.default <= p.high < unit
    states = {s.name: s.initial for s in ArrayAttitude().states}
    assert states["p66"] == (params["p0_heading"].default / interface.UNITS["heading"]) ** 2
    assert set(interface.LEARNT) == {SCALE, *GYRO, *FORCE}


def test_without_the_filter_only_the_strapdown_is_left() -> None:
    e = ArrayAttitude(aided=False)
    assert e.outputs == strapdown.OUTPUTS and {p.name for p in e.params} == {
        *("latitude", "height", "start_qw", "start_qx", "start_qy", "start_qz")
    }
