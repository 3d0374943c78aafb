"""Estimates of a job under way, from the part of it that is recorded."""
