"""Texts about a core: templates, and what fills them in from its description."""
