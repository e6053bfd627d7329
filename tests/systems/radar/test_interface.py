"""What `registration` declares: names that other packages rely on, start values inside ranges."""

from boresight.systems.radar import interface


def test_names_and_units() -> None:
    assert [i.name for i in interface.INPUTS] == [
        *("dt", "x1", "y1", "z1", "x2", "y2", "z2", "seen_1", "seen_2")
    ]
    units = {o.name: o.unit for o in interface.OUTPUTS}
    assert units["range_1_bias"] == "m" and units["azimuth_2_bias"] == "rad"
    assert units["z2_corrected"] == "m" and units["status"] == "bits"
    flags = [i for i in interface.INPUTS if i.flags]
    assert [f.flags for f in flags] == [("x1", "y1", "z1"), ("x2", "y2", "z2")]


def test_every_noise_and_first_spread_is_a_parameter() -> None:
    names = {p.name for p in interface.PARAMS}
    for bias in interface.BIASES:
        kind, _, radar = bias.partition("_")
        assert {f"p0_{bias}", f"{kind}_sd_{radar}"} <= names
    assert all(s.low <= s.initial <= s.high for s in interface.STATES)
    widest = next(p for p in interface.PARAMS if p.name == "p0_range_1")
    assert widest.high * 10.0 >= 1e4  # 10 km at the noise of 10 m
