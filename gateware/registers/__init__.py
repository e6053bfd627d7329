"""Declared registers, and those of every core."""
