"""The readers beside their devices, pin to pin.

===================== ==============================================================
module                what it holds
===================== ==============================================================
adis16385_bench       reader and device: what happened, as records
adis16385_contract    what the reader must have done
adis16385_fuzz        the reader against a device that does whatever it likes
hmr3300_device_bench  reader and compass by a script: what happened, as records
hmr3300_grammar       what a reader must make of a stream of bytes
hmr3300_symbols       hostile bytes and levels
hmr3300_fuzz          the reader against the grammar, on these
===================== ==============================================================
"""
