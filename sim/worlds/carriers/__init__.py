"""Carriers that never rest, and logs of a sensor on them."""
