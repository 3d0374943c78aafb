"""Samples for other software: as a sheet with units, in its formats, and many as one zip."""
