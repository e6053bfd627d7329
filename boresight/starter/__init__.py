"""What `boresight new` writes: an estimator with its world, a log of that world, and their test."""
