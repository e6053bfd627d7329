"""The readers of the sensors beside models of their devices, pin to pin."""
