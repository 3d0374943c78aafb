"""Recursive estimate of a constant bias: its uncertainty after each measurement, and the dwell that is needed."""
