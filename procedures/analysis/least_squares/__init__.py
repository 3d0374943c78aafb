"""Weighted least squares that every fit stands on: whitening, rank and determination."""
