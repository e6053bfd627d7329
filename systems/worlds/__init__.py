"""A strapdown inertial unit: exact increments, errors of its sensors, the turntable it is on."""
