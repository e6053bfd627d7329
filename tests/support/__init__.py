"""Instruments of the tests: nothing of the package imports them.

| module | what |
|---|---|
| `bench` | simulated benches of Amaranth: runs, streams, buses, pulses |
| `attitude` | attitude filters on exact sensors: records, runs, errors |
| `random_program` | random legal programs |
| `conductor_bench` | plays a script to the attitude core |
| `devices` | readers and devices pin to pin, their contracts, fuzzing |
| `board` | the board's bench under cocotb |
| `soc` | costs of single operations on the soft core |
| `strangers` | records of the programs in `tests/strangers/programs` and `examples` |
"""
