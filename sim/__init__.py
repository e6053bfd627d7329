"""Records, levels, comparison, closed loops, proofs, reports.

| room | what |
|---|---|
| `records` | columns by input name: from logs, arrays or worlds |
| `rtl` | the core's Verilog under simulators |
| `levels` | every form of an estimator behind one protocol |
| `worlds` | closed loops |
| `rotations` | rotations and errors in degrees |
| `compare` | difference, verdict, culprit; check of all levels |
| `fit` | formats from what values reach in runs |
| `report` | the report of a core |
| `accuracy` | figures over many logs |
| `experiments` | systems of the literature, repeated |
| `attitude` | the attitude system of the 2014 paper: sensors, board, robustness, experiment |
| `formal` | proofs |
"""
