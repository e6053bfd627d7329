"""Flags and events as hosts read them: their bits are part of the register map."""

from boresight.gateware.sensors.adis16385_flags import EVENT_MEANINGS, EVENTS, FLAG_MEANINGS, FLAGS


def test_bits_of_the_flags() -> None:
    assert {name: field.offset for name, field in FLAGS} == {
        "running": 0,
        "identity_error": 1,
        "config_error": 2,
        "no_data_ready": 3,
        "link_error": 4,
        "alarm": 5,
        "over_range": 6,
        "overrun": 7,
    }
    assert all(field.width == 1 for _, field in FLAGS)


def test_what_can_be_flagged_also_happens() -> None:
    """An event for every flag but the state of running, in the same order; and two of their own."""
    assert ("sample", *[name for name in FLAG_MEANINGS if name != "running"], "restart") == EVENTS
    assert all({**FLAG_MEANINGS, **EVENT_MEANINGS}.values())
