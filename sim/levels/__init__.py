"""Levels: one estimator in its forms, behind one protocol; `sim.levels.registry` has them all."""
