"""Kalman filters from their model: Jacobians, covariance, updates and ranges are derived."""
