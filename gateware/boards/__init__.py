"""Boards: designs on their pins, a core that the host feeds, ISE projects, bitstreams."""
