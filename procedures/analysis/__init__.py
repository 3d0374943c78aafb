"""Analyses of recordings as pure functions, one subject per file. Shares no equation with the simulators."""
