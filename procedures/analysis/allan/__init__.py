"""The Allan family: one engine for arrays and streams, with intervals; paper A's band; the graphical read-off.

`statistic`: the formulas; `deviation`: the entry point; `integral`, `overlapping` and `differences`: the term-by-term
engine; `correlated` with `lagged` and `averages`: the fast one for long series; `identification` and
`confidence_intervals`: the uncertainty; `band`: the spread over all start offsets; `read_off`: the graphical method.
"""
