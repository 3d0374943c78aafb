"""Simulated power supply of the unit."""
