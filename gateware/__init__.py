"""The engine in Amaranth and the compiler that feeds it.

| module | what |
|---|---|
| `machine` | description of the machine: lanes, stages, microword |
| `schedule`, `list_*`, `priorities`, `arrange`, `captures`, `copies`, `slots` | scheduling |
| `check_schedule`, `check_core` | independent proof of a schedule, and of several in one core |
| `allocate`, `state_rooms`, `microcode`, `listing`, `image` | registers, assembler, memories |
| `emulator` | the machine cycle by cycle in Python |
| `engine`, `sequencer`, `operands`, `lane`, `multiplier`, `shifter`, ... | the hardware |
| `core`, `verilog` | one program or several as a core; Verilog text |
| `registers`, `register_*` | register bus and its generated descriptions |
| `synthesis` | area and clock estimate |
| `boards` | tops and ISE projects |
"""
