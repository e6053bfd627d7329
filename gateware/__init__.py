"""The engine in Amaranth and the compiler that feeds it.

| room or module | what |
|---|---|
| `machine` | description of the machine: lanes, stages, microword |
| `schedule` | when and where each operation runs, and an independent proof of it |
| `microcode` | assembler, memories, listing, an emulator cycle by cycle |
| `registers`, `description` | declared registers; what a compiled core is, in one object |
| `texts` | templates that the description fills in |
| `bus` | the register bus and what hangs on it |
| `engine` | the hardware: sequencer, operands, lanes |
| `core`, `verilog` | one program or several as a core; Verilog text |
| `serial`, `sensors`, `system`, `soc`, `boards` | around the core, up to whole FPGAs |
| `synthesis` | area and clock estimate |
"""
