"""Verbs that give figures over many logs, draws or updates."""
