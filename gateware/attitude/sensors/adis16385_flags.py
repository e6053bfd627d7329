"""Status of the reader of the ADIS16385: a table of flags and one of events."""

from __future__ import annotations

from typing import Final

from amaranth.lib import data

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
