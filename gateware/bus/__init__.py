"""Buses: the registers of a core, declared registers, AXI."""
