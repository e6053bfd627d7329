"""Rotations: quaternions, Euler angles, errors of attitudes in degrees."""
