"""The sensors at their pins: models in SystemVerilog, with every fault as a switch.

============ ===========================================
file         what it holds
============ ===========================================
adis16385.sv the inertial sensor
adis16385    its text for benches, names of its faults
hmr3300.sv   the compass
hmr3300      the same of the compass
============ ===========================================
"""
