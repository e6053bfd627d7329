"""A RISC-V soft core, to measure software beside the attitude core."""
