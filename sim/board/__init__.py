"""The complete board in simulation: both devices at its pins, the host's serial line, a judge.

=========== =====================================================================================
module      what it holds
=========== =====================================================================================
bench.sv    the system, the models of both devices and the host's side of the line, in one module
setup       speeds and times: the real ones, or scaled
build       a system for these speeds, and the bench's sources
trace       what the bench wrote, as arrays
run         a log through the compiled board, and the chain of integer models beside it
spans       one update's way out of a trace
timeline    that as a figure; page: the page that shows it
faults      every fault of the devices: when it is seen, what it does to the attitude
=========== =====================================================================================
"""
