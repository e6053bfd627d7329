"""Figures of estimators over many logs: scores, peers, benchmark, tuning, covariance."""
