"""Declared registers, and the texts made of them: JSON, C header, SVD, page."""
