"""Calibration of the sensors from records of the board: the registers before the filters.

`records` finds rests, turns and lines of the compass in records of raw counts; `solve` fits the
registers to all of them together; `files` writes the result. `world` simulates such records, with
known registers; ``python -m boresight.sim.attitude.calibration`` runs it.
"""
