"""Recordings as bytes: chunks at rest, files going out, files coming in. Knows no SQL, no HTTP and no jobs."""
