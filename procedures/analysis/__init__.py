"""Analyses of recordings as pure functions, one subject a folder or file. Shares no equation with the simulators."""
