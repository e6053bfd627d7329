"""What is proven, block by block; each module has `PROOFS`."""
