"""The parts of the inertial sensor's reader: frames, setup, full scale, flags."""

import pytest
from amaranth.hdl import Module, Signal
from amaranth.sim import Simulator

from boresight.gateware.attitude.sensors.adis16385_flags import (
    EVENT_MEANINGS,
    EVENTS,
    FLAG_MEANINGS,
    FLAGS,
)
from boresight.gateware.attitude.sensors.adis16385_frames import (
    CHECKED,
    COMM_FAILURE,
    CONFIG_FRAMES,
    FIRST,
    FIRST_RUN,
    LAST,
    REGISTERS,
    RUN_FRAMES,
    STEPS,
    WORDS,
    Step,
    read,
    write,
)
from boresight.gateware.attitude.sensors.adis16385_range import at_full_scale
from boresight.gateware.attitude.sensors.adis16385_setup import Settings, Timing

# --------------------------------------------------------------------------------------------------
# the row of frames: what is asked for, and that each answer is the one of the frame before


def test_commands() -> None:
    assert read("PROD_ID") == 0x5600
    assert write("SMPL_PRD", 0, 0x01) == 0xB601
    assert write("SMPL_PRD", 1, 0xFF) == 0xB7FF


def sample(place: int) -> list[tuple[int, Step]]:
    """Frames of a sample in which the register at a place of `CHECKED` is checked."""
    return [(k, STEPS[k]) for k in (*range(FIRST_RUN, LAST + 1), 24 + place, 28 + place)]


def test_a_sample_asks_for_each_word_and_one_setting() -> None:
    for place, name in enumerate(CHECKED):
        frames = sample(place)
        assert len(frames) == RUN_FRAMES
        asked = [step.register for _, step in frames]
        assert sorted(asked) == sorted([*WORDS, name])
        # An answer comes with the next frame; the first one's was asked for by the last sample.
        answers = ["TEMP_OUT", *asked[:-1]]
        for answer, (number, step) in zip(answers, frames, strict=True):
            assert step.byte is None
            if step.store is not None:
                assert WORDS[step.store] == answer
            if step.check is not None:
                assert CHECKED[step.check] == answer == name and step.check == number % 4
        assert sorted(s.store for _, s in frames if s.store is not None) == list(range(len(WORDS)))
        assert [s.check for _, s in frames if s.check is not None] == [place]


def test_the_start_checks_the_device_before_it_writes() -> None:
    numbers = range(FIRST, FIRST + CONFIG_FRAMES)
    assert sorted(STEPS) == [*numbers, *range(FIRST_RUN, LAST + 1), *range(24, 32)]
    steps = [STEPS[k] for k in numbers]
    writes = [(step.register, step.byte) for step in steps if step.byte is not None]
    assert writes == [(name, byte) for name in CHECKED[1:] for byte in (0, 1)]
    first_write = next(k for k in numbers if STEPS[k].byte is not None)
    identity = next(k for k in numbers if STEPS[k].check is not None)
    assert STEPS[identity].check == 0 and STEPS[identity - 1].register == "PROD_ID"
    assert identity < first_write
    # Then all that was written is read back, each checked with the answer of the frame before.
    last_write = max(k for k in numbers if STEPS[k].byte is not None)
    checks = [k for k in numbers if k > last_write and STEPS[k].check is not None]
    assert [CHECKED[STEPS[k].check or 0] for k in checks] == list(CHECKED)
    for k in checks:
        assert STEPS[k - 1].register == CHECKED[STEPS[k].check or 0]
        assert STEPS[k].check == k % 4 and STEPS[k].byte is None


def test_addresses_are_even_and_their_own() -> None:
    assert len(set(REGISTERS.values())) == len(REGISTERS)
    assert all(address % 2 == 0 and address < 0x80 for address in REGISTERS.values())


# -- times, settings and limits of the reader: the defaults, and what is refused ------------------


@pytest.mark.parametrize(
    "options, message",
    [
        ({"identity": 0x10000}, r"^identity must be an integer from 0 to 65535, not 65536$"),
        ({"sens_avg": -1}, r"^sens_avg must be an integer from 0 to 65535, not -1$"),
        ({"gyro_limit": 0}, r"^gyro_limit must be an integer from 1 to 32767, not 0$"),
        ({"bad_limit": 17}, r"^bad_limit must be an integer from 1 to 16, not 17$"),
        ({"bad_limit": True}, r"^bad_limit must be an integer from 1 to 16, not True$"),
        ({"sclk_hz": 0}, r"^sclk_hz must be a positive number, not 0$"),
        ({"timeout_periods": 0.5}, r"^timeout_periods must be 1 or more, not 0\.5$"),
        ({"timeout_periods": float("nan")}, r"^timeout_periods must be 1 or more, not nan$"),
        ({"accel_limit": 0x8000}, r"^accel_limit must be an integer from 1 to 32767, not 32768$"),
        ({"bad_limit": 0}, r"^bad_limit must be an integer from 1 to 16, not 0$"),
        ({"sclk_hz": True}, r"^sclk_hz must be a positive number, not True$"),
    ],
)
def test_values_are_checked(options, message: str) -> None:
    kind = Timing if options.keys() <= vars(Timing()).keys() else Settings
    with pytest.raises(ValueError, match=message):
        kind(**options)


def test_the_ends_of_the_ranges() -> None:
    Timing(timeout_periods=1.0, sclk_hz=1e-3)
    for limit in (1, 0x7FFF):
        Settings(gyro_limit=limit, accel_limit=limit)
    Settings(identity=0xFFFF, sens_avg=0, bad_limit=16)
    Settings(bad_limit=1)


def test_what_stops_a_sample_is_an_alarm_too_and_one_bit_is_neither() -> None:
    settings = Settings()
    assert settings.invalid_mask == COMM_FAILURE
    assert settings.alarm_mask & settings.invalid_mask == settings.invalid_mask
    assert settings.alarm_mask == 0xFFFF ^ 1 << 7
    assert Timing().period_s == 1 / 1024 and (settings.gyro_limit, settings.accel_limit) == (
        24_000,
        20_000,
    )


# -- full scale, to the last count, either sign, of the limit that is selected --------------------


@pytest.mark.parametrize("limits", [(24000, 20000), (1, 2), (32767, 32766), (300, 300)])
def test_against_the_magnitude(limits: tuple[int, int]) -> None:
    word = Signal(16)
    select = Signal()
    result = Signal()
    m = Module()
    m.d.comb += result.eq(at_full_scale(word, select, limits))
    near = {sign * (limit + k) for limit in limits for k in (-1, 0, 1) for sign in (1, -1)}

    async def bench(ctx):
        for value in sorted({*near, 0, 1, -1, -2, 32767, -32767, -32768}):
            for which, limit in enumerate(limits):
                if -32768 <= value < 32768:
                    ctx.set(word, value & 0xFFFF)
                    ctx.set(select, which)
                    await ctx.delay(1e-9)
                    assert ctx.get(result) == (not -limit < value < limit), (value, limit)

    simulator = Simulator(m)
    simulator.add_testbench(bench)
    simulator.run()


# -- flags and events as hosts read them: their bits are part of the register map -----------------


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
