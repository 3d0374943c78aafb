"""The Allan family: one engine for arrays and streams, with intervals; paper A's band; the graphical read-off.

`statistic` the formulas, `deviation` the entry; `integral`, `overlapping` and `differences` the engine term by term,
`correlated` with `lagged` and `averages` the fast one for long series; `identification` and `freedom` the uncertainty,
`band` every start offset, `read_off` the graphical method.
"""
