"""The complete board in simulation: both devices, the host's serial line, comparison with models.

=========== =====================================================================================
module      contents
=========== =====================================================================================
bench.sv    the system, the models of both devices and the host's side of the line, in one module
build       speeds and times, real or scaled; a system for them, and the bench's sources
trace       output of the bench as arrays
run         a log through the compiled board, and the chain of integer models beside it
faults      every fault of the devices: detection, and effect on the attitude
=========== =====================================================================================
"""
