"""Results of verbs with many figures, and their texts."""
