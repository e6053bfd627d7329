"""Comparisons: levels with the interpreter, outputs with float64 or truth, each with a verdict."""
