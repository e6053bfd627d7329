"""The soft core in simulation: `measure`, filters in software; `offload`, the core over the bus."""
