"""Programs as C: `emit` writes it, `build` compiles it for the host and calls it."""
