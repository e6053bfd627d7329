"""Intel Cyclone V: area, by yosys alone."""
