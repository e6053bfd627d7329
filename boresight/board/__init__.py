"""The host end of a board: serial line and plot."""
