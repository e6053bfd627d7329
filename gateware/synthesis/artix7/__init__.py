"""Xilinx Artix-7: area, by yosys alone."""
