"""Verilog under simulators: tools, builds, cocotb, compiled benches, several programs at once."""
