"""The complete board in simulation: both devices at its pins, the host's serial line, a judge.

========= =====================================================================================
module    what it holds
========= =====================================================================================
bench.sv  the system, the models of both devices and the host's side of the line, in one module
build     that bench as a compiled simulation, or for cocotb
trace     what the bench wrote, as arrays
run       a log through the board: frames, cycles, and the chain of integer models beside them
timeline  from data-ready to the last bit of the frame, as a figure
faults    every fault of the devices: when it is seen, what it does to the attitude
========= =====================================================================================
"""
