"""Formal proofs of the attitude board: SPI, compass, results, buses (`boresight.sim.formal`)."""
