"""Worlds: closed loops in which an estimator's outputs determine its next measurements."""
