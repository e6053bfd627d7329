"""The host side of a board: serial line and plot."""
