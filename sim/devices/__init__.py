"""The sensors at their pins: models in SystemVerilog, with every fault as a switch.

================ ==============================================================
file             what it holds
================ ==============================================================
adis16385.sv     the inertial sensor
adis16385        reader and device, pin to pin: what happened, as records
adis16385_model  what the reader must have done, by its contract
adis16385_fuzz   the reader against a device that does whatever it likes
hmr3300.sv       the compass
hmr3300          reader and compass by a script: what happened, as records
hmr3300_grammar  what a reader must make of a stream of bytes
hmr3300_symbols  hostile bytes and levels
hmr3300_fuzz     the reader against the grammar, on these
================ ==============================================================
"""
