"""Xilinx Spartan-6: area and a clock estimate without the vendor's tools.

========== ====================================================================
module     contents
========== ====================================================================
family     the family, as the targets have it
device     the parts: how many of each primitive, packages, grades
delays     cell and net delays of grades -2 and -3, with sources and guesses
celltypes  the known primitives, by kind
area       primitive counts and percentages
slice_arcs, memory_arcs, dsp_arcs: timing arcs of cells
routing    the net between two pins
========== ====================================================================
"""
