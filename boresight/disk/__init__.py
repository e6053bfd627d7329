"""What Boresight keeps on disk: results of verbs, and the build cache.

The lowest room beside `boresight.model`: it imports `boresight.model.errors` and
`boresight.model.user_folders` alone, and every room may import it (`docs/decisions/0014-files.md`).
"""
