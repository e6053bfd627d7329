"""What Boresight keeps on disk: results of verbs, and the build cache.

The lowest room beside `boresight.model`, of which it imports errors and user folders alone; every
room may import it (`docs/decisions/0014-files.md`).
"""
