"""Repeated initial alignment at known attitudes: expected errors and observed errors."""
