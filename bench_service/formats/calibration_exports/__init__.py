"""Calibrations as files for other software: one module a consumer, `forms.py` has them all."""
