"""How long a test waits for what is due at once, on a machine with twenty other processes."""

BUSY_S = 20.0
"""Longest time that something due at once takes there [s]. What these tests rule out takes 30 s or never comes."""
