"""Boards with an XC6SLX9: a core that talks over a serial line, and its ISE projects.

========== ====================================================================
module     what it holds
========== ====================================================================
frames     the frames on the serial line, in software: `encode`, `Decoder`
uart       `Receiver` and `Transmitter` of bytes
unpack     bytes to whole, checked frames
dispatch   frames to the core's input stream and register bus
pack       output records and replies to bytes
top        `Top`: the core with all of these; pins rx, tx and two LEDs
clock      clock of the core from the board's oscillator, by PLL if need be
ise        `write_ise_project` for the boards in `BOARDS`
========== ====================================================================
"""
