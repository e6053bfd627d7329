"""Carriers that never rest, and what a sensor on them sees."""
