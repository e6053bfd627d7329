"""Synthetic logs of a body that turns, and errors of its sensors."""
