"""Cycle, lane and registers of each operation of a program; `gateware.core` calls them."""
