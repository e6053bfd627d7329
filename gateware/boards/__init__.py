"""Boards: designs on their pins, a core that the host feeds, ISE projects, bitstreams.

=========== ====================================================================
module      contents
=========== ====================================================================
board       the boards, and the pins of a design's lines
uart        the serial line
frames      the frames on the serial line, in software: `encode`, `Decoder`
unpack      bytes to complete, checked frames
dispatch    frames to the core's input stream and register bus
pack        output records and replies to the bodies of frames
framer      bodies to frames
top         `Top`: the core with all of these; pins rx, tx and two LEDs
clock       clock of the core from the board's oscillator, by PLL if needed
project     a design on a board: an ISE project, or the bitstream of an open tool
=========== ====================================================================
"""
