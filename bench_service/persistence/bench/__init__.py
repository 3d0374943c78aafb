"""Benches, live state and prompts in SQL; the lease of a bench and the files of its host."""
