"""Texts about a core: templates, filled in from its description."""
