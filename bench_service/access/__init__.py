"""People and programs, their roles, and how they prove who they are. Values and rules; no HTTP, no SQL."""
