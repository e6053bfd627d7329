"""Gowin GW2A and GW5A, placed and routed by nextpnr."""
