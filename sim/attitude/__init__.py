"""The attitude system of the 2014 paper in simulation: sensors, board, filters, experiment."""
