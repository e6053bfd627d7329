"""Xilinx Spartan-6: area by yosys, and an estimate of the clock."""
