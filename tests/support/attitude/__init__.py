"""Benches and helpers of the tests of the attitude system."""
