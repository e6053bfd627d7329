"""Two radars whose tracks tell each other's biases: Cui et al. (2014)."""
