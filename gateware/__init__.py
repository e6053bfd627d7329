"""The engine in Amaranth and the compiler that feeds it.

| room or module | what |
|---|---|
| `machine` | description of the machine: lanes, stages, microword |
| `schedule` | cycle, lane and register of each operation |
| `microcode` | assembler, memories, proof |
| `registers`, `description` | declared registers; the description of a compiled core |
| `texts` | templates filled in from the description |
| `bus` | the register bus and its devices |
| `engine` | the hardware: sequencer, operands, lanes |
| `core`, `verilog` | one program or several as a core; Verilog text |
| `boards` | a core on a board: clocks, host line, project |
| `attitude` | the attitude system of the 2014 paper |
| `synthesis` | area and clock estimate |
"""
