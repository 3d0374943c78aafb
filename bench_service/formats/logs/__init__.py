"""Readers of log files that others made: one file a format, one shape.

Each reader lists the tables of a file (`table`: columns with unit, scale and the source of both, clocks, doubts) and
yields the rows of one in blocks. It never holds a whole file. `registry` finds the reader of a file; `columns` gives
the rows on as the importer takes them. Nothing here decides the meaning of a column: a person confirms the description
that is proposed from it.
"""
