"""The complete attitude system: sensor pins in, attitude out.

================== ============================================================
module             contents
================== ============================================================
attitude_system    `AttitudeSystem`: the complete system, on pins
attitude_core      the core and its update controller
conductor          the update controller: samples through the core's programs
conductor_words    the words of the update controller
programs, plan     the core's programs, and their data for the controller
feed               input routing: sources of the words of records
attitude_output    frames for the host
attitude_frame     frames in software
bridge             the host's serial line
system_bus         the address map
interface          registers, result words, orders, events: declared once
================== ============================================================
"""
