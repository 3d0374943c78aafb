"""Recordings as bytes: chunks in storage, export files, import files; and JSON that every store and client can hold.

Knows no SQL, no HTTP and no jobs.
"""
