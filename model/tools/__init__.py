"""The world outside: folders of the user, and tools that fail."""
