"""Ranges that an estimator states: proven, checked, or how far a search came to their ends."""
