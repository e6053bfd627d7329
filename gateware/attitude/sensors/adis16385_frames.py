"""Registers and commands of the ADIS16385, and the reader's sequence of frames.

Addresses, identity and word formats are the maker's (register map of the iSensor evaluation
software); the meaning of the bits of DIAG_STAT, MSC_CTRL, SMPL_PRD and SENS_AVG is a sibling
part's (ADIS16334, ADIS1636x), and so is the pipeline: a frame's answer is what the frame before
it asked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

#: Register addresses.
REGISTERS: Final = {
    "XGYRO_OUT": 0x04,
    "YGYRO_OUT": 0x06,
    "ZGYRO_OUT": 0x08,
    "XACCL_OUT": 0x0A,
    "YACCL_OUT": 0x0C,
    "ZACCL_OUT": 0x0E,
    "TEMP_OUT": 0x10,
    "MSC_CTRL": 0x34,
    "SMPL_PRD": 0x36,
    "SENS_AVG": 0x38,
    "DIAG_STAT": 0x3C,
    "PROD_ID": 0x56,
}
#: Words of a sample, by their index.
WORDS: Final = (
    "XGYRO_OUT",
    "YGYRO_OUT",
    "ZGYRO_OUT",
    "XACCL_OUT",
    "YACCL_OUT",
    "ZACCL_OUT",
    "TEMP_OUT",
    "DIAG_STAT",
)
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
    """A frame: its command, and the use of its reply.

    Attributes
    ----------
    register : str
        Register that is read or written.
    byte : int or None
        Byte that is written (0 low, 1 high); None: a read.
    store : int or None
        Index of the sample's word in the reply.
    check : int or None
        Place in `CHECKED` of the register that the answer is; always the step's number modulo 4,
        and the step is a read.
    """

    register: str
    byte: int | None = None
    store: int | None = None
    check: int | None = None


def _steps() -> dict[int, Step]:
    # Nothing is written to an unidentified device.
    steps = {3: Step("PROD_ID"), 4: Step("PROD_ID", check=0), 11: Step("PROD_ID")}
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


#: All frames by the number of their step: 3..15 at the start, 16..22, 24 + k, 28 + k for each
#: sample, with the place k of the register that is checked with this sample.
STEPS: Final = _steps()
#: First step, first step of a sample, last step before the check.
FIRST, FIRST_RUN, LAST = 3, 16, 22
#: Frames of the start, and of a sample.
CONFIG_FRAMES, RUN_FRAMES = 13, 9
