"""A small computer around a RISC-V soft core, for software beside the attitude core.

========================  ======================================================  ==============
component                 contents                                                acknowledges in
========================  ======================================================  ==============
`cpu.Cpu`                 VexRiscv (RV32IM, 4 KB + 4 KB cache)
`memory.Ram`              block RAM, instructions and data                        1 cycle
`control.Control`         timer, watchdog, console, error flags                   1 cycle
`system.Soc`              all of them, and a slot for a Wishbone device
`attitude_soc`            the attitude system in that slot
========================  ======================================================  ==============
"""
