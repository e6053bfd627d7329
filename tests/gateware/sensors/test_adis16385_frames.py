"""The row of frames: what is asked for, and that each answer is the one of the frame before."""

from boresight.gateware.sensors.adis16385_frames import (
    CHECKED,
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
