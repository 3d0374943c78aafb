"""Is a recording fit to be analysed: one pass over its raw samples, in bounded memory, a sentence for every flaw.

`stream` the entry, `findings` what comes out, `pieces` the samples cut alike however they came; then one file a
question: `edges` saturated, `bits` stuck or coarse, `repeats` hung data link, `jumps` outliers and steps,
`plausibility` wrong unit.
"""
