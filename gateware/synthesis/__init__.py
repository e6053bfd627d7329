"""Area of a core on a part, and its clock: routed with open tools, or estimated on Spartan-6.

============ ==================================================================
module       contents
============ ==================================================================
targets      every target: a part of a family at a speed grade
family       description of a family: synthesis, cells, registers, router, parts
device       a part: how many of each resource
spartan6/    the families, a folder each (``docs/targets.md``)
ecp5/, ice40/
nexus/, gowin/
area_alone   families that no router has
yosys        Verilog to the netlist of a family
registers    flip-flops move into multipliers and memories
nextpnr      placed, routed, timed
routed       all of these in one call
blocks       block RAM of a core, before any synthesis
============ ==================================================================
"""
