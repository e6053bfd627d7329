"""What operations cost on the soft core."""
