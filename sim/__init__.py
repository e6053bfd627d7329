"""Logs and bundled data, co-simulation, proofs, reports.

| module | what |
|---|---|
| `log`, `bundled`, `synthetic` | sensor logs: read, shipped, made with exact truth |
| `feed` | from a log to input records, from output records to attitude |
| `check`, `segments`, `divergence` | every level on the same input; where they first differ |
| `cosim`, `replay_bench`, `simulators` | the core's Verilog under cocotb |
| `accuracy` | attitude error in degrees |
| `extremes`, `report_*` | observed ranges, `report.json`, the HTML page |
"""
