"""Verilog under simulators: tools, builds, cocotb, compiled benches, several programs in turns."""
