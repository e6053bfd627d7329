"""Lattice iCE40 UltraPlus, placed and routed by nextpnr."""
