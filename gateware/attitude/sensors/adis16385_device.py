"""Registers and times of the ADIS16385; frames, flags and events of its reader.

Addresses, identity and word formats are the maker's (register map of the iSensor evaluation
software); the meaning of the bits of DIAG_STAT, MSC_CTRL, SMPL_PRD and SENS_AVG is a sibling
part's (ADIS16334, ADIS1636x), and so is the pipeline: a frame's answer is what the frame before
it asked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from amaranth.lib import data

#: Register addresses.
REGISTERS: Final = {
    **{f"{axis}GYRO_OUT": 0x04 + 2 * k for k, axis in enumerate("XYZ")},
    **{f"{axis}ACCL_OUT": 0x0A + 2 * k for k, axis in enumerate("XYZ")},
    "TEMP_OUT": 0x10,
    "MSC_CTRL": 0x34,
    "SMPL_PRD": 0x36,
    "SENS_AVG": 0x38,
    "DIAG_STAT": 0x3C,
    "PROD_ID": 0x56,
}
#: Words of a sample, by their index: gyro, accelerometer, temperature, state.
WORDS: Final = (*list(REGISTERS)[:7], "DIAG_STAT")
#: Registers with known contents, in the order of their checks.
CHECKED: Final = ("PROD_ID", "MSC_CTRL", "SMPL_PRD", "SENS_AVG")
#: Contents of PROD_ID.
IDENTITY: Final = 0x4001
#: Ranges of the gyro by bits 10:8 of SENS_AVG (sibling part): how often +-300 deg/s is halved.
#: All other codes count as +-300 deg/s.
RANGE_SHIFTS: Final = {2: 1, 1: 2}
#: Fraction bits of a sample's words, so that every range has the same unit.
FRACTION: Final = max(RANGE_SHIFTS.values())
#: Bit of DIAG_STAT: a frame had not 16 clocks (sibling part).
COMM_FAILURE: Final = 1 << 3


def read(register: str) -> int:
    """Command that requests a register."""
    return REGISTERS[register] << 8


def write(register: str, byte: int, value: int) -> int:
    """Command that writes a byte (0 low, 1 high) of a register."""
    return 0x8000 | (REGISTERS[register] + byte) << 8 | value


@dataclass(frozen=True)
class Step:
    """A frame: its command, and the use of its reply."""

    register: str
    byte: int | None = None  #: that is written (0 low, 1 high); None: a read
    store: int | None = None  #: index of the sample's word in the reply
    #: Place in `CHECKED` of the register that the answer is; always the step's number modulo 4,
    #: and the step is a read.
    check: int | None = None


def _steps() -> dict[int, Step]:
    # Nothing is written to an unidentified device. What PROD_ID would get is the host's.
    steps = {
        HOST: Step("PROD_ID", 0),
        2: Step("DIAG_STAT"),
        3: Step("PROD_ID", store=WORDS.index("DIAG_STAT")),
        4: Step("PROD_ID", check=0),
        11: Step("PROD_ID"),
    }
    for k, name in enumerate(CHECKED[1:]):
        steps[5 + 2 * k], steps[6 + 2 * k] = Step(name, 0), Step(name, 1)
    for k, name in enumerate((*CHECKED[1:], "TEMP_OUT")):
        steps[12 + k] = Step(name, check=k)
    for k, name in enumerate((*WORDS[:6], "DIAG_STAT")):
        steps[16 + k] = Step(name, store=(k - 1) if k else WORDS.index("TEMP_OUT"))
    for k, name in enumerate(CHECKED):
        steps[24 + k] = Step(name, store=WORDS.index("DIAG_STAT"))
        steps[28 + k] = Step("TEMP_OUT", check=k)
    return steps


#: Step of a command of the host.
HOST: Final = 1
#: All frames by the number of their step: 2..15 at the start, 16..22, 24 + k, 28 + k for each
#: sample, with the place k of the register that is checked with this sample.
STEPS: Final = _steps()
#: First step, step that begins a self-test by bit 10 of MSC_CTRL (sibling part), first step of a
#: sample, last step before the check, a request of the temperature.
FIRST, TEST, FIRST_RUN, LAST, TEMPERATURE = 2, 6, 16, 22, 28
TEST_BYTE: Final = 1 << 10 - 8
#: Frames of the start, and of a sample.
CONFIG_FRAMES, RUN_FRAMES = 14, 9
#: Bits of DIAG_STAT (sibling part) that a self-test sets, and what has failed.
TEST_BITS: Final = {
    5: "self_test",
    **{10 + k: f"{axis}_gyro" for k, axis in enumerate("zyx")},
    **{13 + k: f"{axis}_acceleration" for k, axis in enumerate("xyz")},
}


@dataclass(frozen=True)
class Timing:
    """Times of the device, Hz and s."""

    #: Highest SPI clock and least pause between frames: those of the maker's own tool.
    sclk_hz: float = 1e6
    stall_s: float = 16e-6
    #: Least wait from the end of the reset pulse to the first frame; least length of that pulse
    #: (both unverified).
    startup_s: float = 0.3
    reset_s: float = 1e-3
    #: Wait for the self-test (unverified; sibling parts take 12 to 45 ms); 0: none is made.
    self_test_s: float = 0.05
    #: Nominal time between samples without decimation.
    period_s: float = 1 / 1024


#: Settings while the reader's members of the same names are not driven: data-ready on DIO1, active
#: high; 1024 samples/s; +-300 deg/s and a filter of 2**2 taps per stage.
SETTINGS: Final = {"msc_ctrl": 0x0006, "smpl_prd": 0x0001, "sens_avg": 0x0402}
#: Full scale of gyro and accelerometer, counts: a magnitude from there on is over-range.
FULL_SCALE: Final = (24_000, 20_000)
#: Bits of DIAG_STAT that raise the alarm.
ALARM_MASK: Final = 0xFF7F


#: Flag: meaning. In the order of their bits.
FLAG_MEANINGS: Final = {
    "running": "identity and settings are checked, samples are being read",
    "identity_error": "PROD_ID was wrong when last read",
    "config_error": "a setting was not what had been written when last read back",
    "no_data_ready": "the data-ready edge is overdue",
    "link_error": "the last sample was dropped: DIAG_STAT says so, or it followed a wrong one",
    "alarm": "DIAG_STAT of the last good sample has an alarm",
    "over_range": "a gyro or accelerometer of the last good sample is at full scale",
    "overrun": "a data-ready edge was skipped just before the last good sample",
}
#: Event: meaning. In the order of their bits; each is one cycle long.
EVENT_MEANINGS: Final = {
    "sample": "a good sample",
    "identity_error": "PROD_ID is wrong: sample dropped, or start given up",
    "config_error": "a setting reads back wrong: sample dropped, or start given up",
    "no_data_ready": "the data-ready edge is overdue",
    "link_error": "sample dropped: DIAG_STAT says so, or it is the first after a wrong one",
    "alarm": "a good sample, with an alarm in DIAG_STAT",
    "over_range": "a good sample, with a gyro or accelerometer at full scale",
    "overrun": "a data-ready edge came while a sample was being read: skipped",
    "restart": "reset pulse: too many bad samples in a row, a start given up, or asked for",
}
#: Level flags.
FLAGS: Final = data.StructLayout(dict.fromkeys(FLAG_MEANINGS, 1))
#: Names of the events.
EVENTS: Final = tuple(EVENT_MEANINGS)
