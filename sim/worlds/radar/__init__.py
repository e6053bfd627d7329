"""Two radars that watch one target: what they report, and what they are off by."""
