"""What verbs give that have many figures, and how it is told."""
