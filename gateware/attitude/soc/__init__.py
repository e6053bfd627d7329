"""A RISC-V soft core, to measure software beside the attitude core.

=============== ==================================================================
module          contents
=============== ==================================================================
cpu             VexRiscv (RV32IM, 4 KB + 4 KB cache) and its bus
memory          block RAM for instructions and data
system          both, a cycle counter, and a slot for a Wishbone device
attitude_soc    the attitude system in that slot
=============== ==================================================================
"""
