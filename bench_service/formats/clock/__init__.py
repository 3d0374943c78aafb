"""Analysis of a time column: uniform rate, late arrival, lost or doubled rows, wraps of its counter.

`column` takes the stamps block by block, `pattern` finds how they come, `levels` places what is lost, `rate` the mean
rate by stretches, `judgement` puts it into sentences. Knows no files.
"""
