"""PX4's EKF2: 24 error states, one scalar measurement in each update."""
