"""Estimates from the part of a job that is recorded so far, each with its uncertainty."""
