"""Calibration of a triad from stations: plan, means and their noise, table errors, fit, summary, verification."""
