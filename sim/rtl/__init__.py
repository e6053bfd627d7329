"""Verilog under simulators: tools, builds, compiled benches, one bench of a core."""
