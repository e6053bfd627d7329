"""Inertial navigation with satellite fixes: 15 error states, vehicle and drone."""
