"""Results, counters and bus devices of the attitude system."""
