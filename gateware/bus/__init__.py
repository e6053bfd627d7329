"""Buses: the registers of a core, arbiter, Wishbone, declared registers, counters, results."""
