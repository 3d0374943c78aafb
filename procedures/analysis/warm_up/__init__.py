"""Transients after power-up: whether there is one, what curve it has, and where it ends.

`coloured` the noise of a long record and its whitening, `shapes` the curves, `fit` the test for a transient and its
least squares under that noise, `end` the end of the warm-up. `analysis.self_heating` stands on the same fit.
"""
