"""Lattice ECP5, placed and routed by nextpnr."""
