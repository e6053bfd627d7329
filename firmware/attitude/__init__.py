"""Firmware of the soft core: C sources, start-up, link script, and `image`, which builds them.

=================  =========================================================================
file               contents
=================  =========================================================================
start.S            from reset to ``main``; trap entry
link.ld            memory: protected part (code, constants), data, stack
soc.h, soc.c       devices of the soft core: cycles, console, watchdog, interrupts, stack
text.h, text.c     numbers and lines of text to the console
attitude.h, .c     newest update of the hardware core, read in the interrupt
software.h, .c     the estimator in software, on the same records
main.c             attitude as text, by hardware or by software
measure.c          one estimator in software, driven and observed by a bench
filter.py          ``filter.h``: the estimator of an image
image.py           compiler, flags, sizes, image as words in hexadecimal
=================  =========================================================================
"""
