"""Simulated precision current source of the converter's bench."""
