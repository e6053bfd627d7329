"""Instruments of the tests: nothing of the package imports them.

| module | what |
|---|---|
| `bench` | simulated benches of Amaranth: runs, streams, buses, pulses |
| `exact_sensors` | attitude filters on exact sensors: records, runs, errors |
| `random_program` | random legal programs |
| `attitude.conductor_bench` | plays a script to the attitude core |
| `attitude.devices` | readers and devices pin to pin, their contracts, fuzzing |
| `attitude.board` | the board's bench under cocotb |
| `strangers` | records of the programs in `tests/strangers/programs` and `examples` |
"""
