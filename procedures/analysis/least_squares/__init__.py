"""Weighted least squares common to all fits: whitening, rank and determination."""
