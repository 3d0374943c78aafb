"""Bench file: the description of a bench by its laboratory, in TOML, and everything that is made of it."""
