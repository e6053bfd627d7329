"""The complete attitude system: sensor pins in, attitude out.

================== ============================================================
module             what it holds
================== ============================================================
attitude_system    `AttitudeSystem`: all of it, on pins
attitude_core      the core and its conductor
conductor          samples through the core's programs, results away
programs, plan     the core's programs, and what the conductor is told of them
results            memory of results for several readers
attitude_output    frames or lines of text for the host
attitude_text      what stands where in a line, degrees by additions
attitude_frame     frames and lines in software
bridge             the host's serial line
wishbone           a Wishbone slave
bus_arbiter        several initiators on the register bus
system_bus         the address map
system_registers   the declaration of the registers
csr                registers in hardware, from their declaration
counters           counters of events
================== ============================================================
"""
