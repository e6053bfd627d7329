"""Firmware of the soft core: C sources, start-up, link script, and `image`, which builds them."""
