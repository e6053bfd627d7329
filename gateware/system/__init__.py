"""The complete attitude system: sensor pins in, attitude out.

================== ============================================================
module             what it holds
================== ============================================================
attitude_system    `AttitudeSystem`: all of it, on pins
attitude_core      the core and its conductor
conductor          samples through the core's programs, results away
conductor_words    the words of the conductor
programs, plan     the core's programs, and what the conductor is told of them
feed               where the words of records come from, by the names of inputs
attitude_output    frames or lines of text for the host
attitude_text      what stands where in a line, degrees by additions
attitude_frame     frames and lines in software
bridge             the host's serial line
system_bus         the address map
interface          registers, result words, orders, events: declared once
================== ============================================================
"""
