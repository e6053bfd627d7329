"""Sensorless drive of a synchronous machine: filter and controllers in one core."""
