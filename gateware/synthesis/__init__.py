"""Area and timing estimates for the XC6SLX9 without the vendor's tools.

========== ====================================================================
module     contents
========== ====================================================================
device     the part: how many of each primitive, packages, grades
delays     cell and net delays of grades -2 and -3, with sources and guesses
yosys      Verilog to a Spartan-6 netlist
netlist    that netlist, as cells and nets
celltypes  the known primitives, by kind
area       primitive counts and percentages
arcs       timing arcs of a cell; those of slices, memories and DSP: *_arcs
routing    the net between two pins
graph      the timing graph
timing     longest paths and highest clock
estimate   area and timing in one call
========== ====================================================================

Timing figures are an estimate, not ISE; sign-off needs ``trce``.
"""
