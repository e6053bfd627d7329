"""Readers of the sensors: from pins to checked words.

================== ===================================================================
module             contents
================== ===================================================================
adis16385          the inertial sensor: SPI, data-ready, reset
adis16385_device   its registers, times and settings; frames, flags and events of the reader
hmr3300            the compass: serial line, sentences, commands, stale data
hmr3300_sentence   bytes to headings or counts, by a grammar
hmr3300_command    selection of the kind of sentence, single letters
================== ===================================================================
"""
