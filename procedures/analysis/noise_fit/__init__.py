"""Noise coefficients of a channel: non-negative least squares of an Allan variance, and a likelihood of its spectrum.

`columns`: the expected power of each process; `powers`: the slow and the fast power spectrum of a record; `lines`: its
spectral lines; `restricted`: the likelihood; `selection`: the processes that are present; `likelihood` and
`least_squares`: the two entry points; `estimate`: their result types; `comparison`: disagreements between the methods.
"""
