"""Calibration where there is no bench: two turns by hand, gravity and the Earth's rate (field calibration, F)."""
