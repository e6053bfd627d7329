"""Area and timing estimates for the XC6SLX9 without the vendor's tools.

========== ====================================================================
module     what it holds
========== ====================================================================
device     the part: how many of each primitive, packages, grades
delays     cell and net delays of grades -2 and -3, with sources and guesses
yosys      Verilog to a Spartan-6 netlist
netlist    that netlist, as cells and nets
celltypes  which primitives are known, and as what
area       primitive counts and percentages
arcs       what a cell can say about timing; slice_arcs, memory_arcs, dsp_arcs say it
routing    what lies between two pins
graph      the timing graph
timing     longest paths and highest clock
estimate   all of it in one call
========== ====================================================================

Timing figures are an estimate, not ISE; sign-off needs ``trce``.
"""
