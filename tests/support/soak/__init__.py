"""Long searches for trouble: random programs through the whole compiler, and what tests fuzz."""
