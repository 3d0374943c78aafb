"""Upkeep of the database itself: early forms mended, its file watched, copies made and restored, contents checked."""
