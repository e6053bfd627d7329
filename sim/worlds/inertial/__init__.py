"""What a strapdown inertial unit feels and reports: exact increments, and the errors of sensors."""
