"""A column of time: is it uniform, arrives it late, is a row lost or written twice, does its counter begin again.

`column` takes the stamps block by block, `pattern` finds how they come, `levels` places what is lost, `rate` the mean
rate by stretches, `judgement` puts it into sentences. Knows no files.
"""
