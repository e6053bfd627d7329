"""From a traced graph of real values to a program of integers."""
