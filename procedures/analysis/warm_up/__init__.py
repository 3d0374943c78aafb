"""Transients after power-up: detection, choice of the curve, and the end of the warm-up.

`shapes`: the curves; `fit`: the test for a transient and its least-squares fit under the record's noise
(`analysis.coloured_noise`); `end`: the end of the warm-up. `self_heating` uses the same fit.
"""
