"""Transients after power-up: whether there is one, what curve it has, and where it ends.

`shapes` the curves, `fit` the test for a transient and its least squares under the record's noise
(`analysis.coloured_noise`), `end` the end of the warm-up. `self_heating` stands on the same fit.
"""
