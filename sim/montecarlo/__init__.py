"""Monte-Carlo: many draws of a world on one estimator, and its consistency."""
