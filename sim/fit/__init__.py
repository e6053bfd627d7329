"""Formats from runs: observed ranges, the ranges chosen from them, and their gain."""
