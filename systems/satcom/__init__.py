"""Satcom on the move: patent CN104880189 (2015)."""
