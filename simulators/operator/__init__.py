"""Simulated person at a bench, who does on request what no device can, in some minutes of bench time."""
