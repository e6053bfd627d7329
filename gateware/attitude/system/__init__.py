"""The complete attitude system: sensor pins in, attitude out.

================== ============================================================
module             contents
================== ============================================================
attitude_system    `AttitudeSystem`: the complete system, on pins
conductor          the core and its update controller: samples through its programs
conductor_words    the words of the update controller
programs           the core's programs
plan               their data for the controller: lengths, sources of the words of records
attitude_output    frames for the host
attitude_frame     frames in software
bridge             the host's serial line
system_bus         the address map
interface          registers, result words, orders, events: declared once
================== ============================================================
"""
