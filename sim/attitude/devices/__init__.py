"""Models of the sensors at their pins, in SystemVerilog, with a switch for every fault.

============ ===========================================
file         contents
============ ===========================================
adis16385.sv the inertial sensor
adis16385    its text for benches, names of its faults
hmr3300.sv   the compass
hmr3300      the same of the compass
============ ===========================================
"""
