"""Samples for other software: as a table with units ("sheet"), in its file formats, and many as one zip."""
