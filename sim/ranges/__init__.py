"""Ranges that an estimator states: proven, or how far a search came to their ends."""
