"""Proofs of the blocks of the attitude system."""
