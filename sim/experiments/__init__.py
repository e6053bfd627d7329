"""Published experiments, run again in simulation: one module per paper, one page per run."""
