"""State of charge of a lithium cell: a Kalman filter of its equivalent circuit."""
