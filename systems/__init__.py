"""Systems built with Boresight as any user would: one folder each, by public names only."""
