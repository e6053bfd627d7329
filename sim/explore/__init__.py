"""Many combinations of word, machine and target: cost and errors of each, and the choice."""
