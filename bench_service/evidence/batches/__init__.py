"""Batches of analyses: submission, port of memory, and the runner that claims tasks; no bench is needed."""
