"""Folders of the user, external tools and their failures, names in C, typed data."""
