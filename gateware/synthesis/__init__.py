"""Area of a core on a part, and its clock: routed with open tools, or estimated on Spartan-6.

============ ==================================================================
module       contents
============ ==================================================================
targets      the families as data, and every target: a part at a speed grade
family       description of a family: synthesis, cells, registers, router, parts
spartan6/    the estimate of a clock
yosys        Verilog to the netlist of a family
registers    flip-flops move into multipliers and memories
nextpnr      placed, routed, timed
routed       all of these in one call
blocks       block RAM of a core, before any synthesis
============ ==================================================================
"""
