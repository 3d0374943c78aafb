"""Noise coefficients of a channel: non-negative least squares of an Allan variance, and a likelihood of its spectrum.

`columns` what each process puts into a spectrum, `powers` the spectrum of a record, slow and fast, `lines` what stands
out of it, `restricted` the likelihood, `selection` which processes are there, `likelihood` and `least_squares` the two
entries, `estimate` what they answer, `comparison` where the methods disagree.
"""
