"""The simulated supply."""
