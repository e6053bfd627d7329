"""The sensors at their pins: models in SystemVerilog, with every fault as a switch.

================ ==============================================================
file             what it holds
================ ==============================================================
adis16385.sv     the inertial sensor
adis16385        reader and device, pin to pin: what happened, as records
adis16385_fuzz   the reader against a device that does whatever it likes
hmr3300.sv       the compass
================ ==============================================================
"""
