"""The complete board in simulation: both devices, the host's line, comparison with models."""
