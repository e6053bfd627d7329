"""Families that no router of PyPI has: area, by yosys alone."""
