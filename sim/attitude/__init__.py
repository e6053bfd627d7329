"""What is special of attitude: rotations, the nine-axis log, errors in degrees."""
