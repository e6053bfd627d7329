"""Calibration of the sensors from records of the board: the registers before the filters.

`solve` finds rests, turns and lines of the compass in records of raw counts and fits the registers
to all of them together; `files` writes the result.
"""
