"""Drivers that mount a bench: the simulated one now, real devices later. One file for each maker and device."""
