"""The proofs, block by block; each module has `PROOFS`."""
