"""Routes of manual mode, and their schemas."""
