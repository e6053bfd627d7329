"""Readers of the sensors: from pins to checked words.

================== ============================================================
module             contents
================== ============================================================
adis16385          the inertial sensor: SPI, data-ready, reset
adis16385_frames   its registers and the reader's row of frames
adis16385_flags    flags and events of its reader
adis16385_range    comparison with full scale
hmr3300            the compass: serial line, sentences, commands, stale data
hmr3300_sentence   bytes to headings or counts, by a grammar
hmr3300_number     the numbers in them
hmr3300_command    selection of the kind of sentence, single letters
================== ============================================================
"""
