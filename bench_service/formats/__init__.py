"""Recordings as bytes: chunks at rest, files going out, files coming in; and JSON that everything can hold.

Knows no SQL, no HTTP and no jobs.
"""
