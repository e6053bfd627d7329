"""Formats from runs: what values reach, the ranges chosen from it, and what they gain."""
