"""Estimators as C in single or double precision, from the same record as the fixed program."""
