"""Recordings, results, corrections and units in SQL."""
