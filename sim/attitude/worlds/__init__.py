"""Motions, sensors and recordings of a body that turns."""
