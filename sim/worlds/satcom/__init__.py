"""The world of an antenna on a vehicle: drive, link, closed loop."""
