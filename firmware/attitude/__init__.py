"""Firmware of the soft core: C sources, start-up, link script, and `image`, which builds them.

=================  =========================================================================
file               contents
=================  =========================================================================
start.S, link.ld   from reset to ``main``; memory map
soc.h              cycle counter, updates of the device, words to the bench
measure.c          one estimator in software on recorded inputs: outputs and cycles
offload.c          reads every update of the attitude system over the bus
image.py           compiler, flags, sizes, image as words in hexadecimal
=================  =========================================================================
"""
