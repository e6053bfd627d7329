"""The complete board in simulation: both devices, the host's serial line, comparison with models."""
