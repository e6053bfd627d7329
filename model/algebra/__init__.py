"""Quaternions, vectors and covariances on lists of scalars, traced or not."""
