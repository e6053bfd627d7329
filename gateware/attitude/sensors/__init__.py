"""Readers of the sensors: from pins to checked words."""
