"""Audit trail and counts in SQL."""
