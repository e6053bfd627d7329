"""Verilog under simulators: tools, builds, one bench of a core."""
