"""Attitude filters on logs that are made harder in one way each."""
