"""Lattice CrossLink-NX and Certus-NX, placed and routed by nextpnr."""
