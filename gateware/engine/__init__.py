"""The engine in Amaranth: sequencer, operands, lanes, multiplier, shifters."""
