"""Recordings in, numbers out: pure functions, one subject a file. Shares no equation with the simulators."""
