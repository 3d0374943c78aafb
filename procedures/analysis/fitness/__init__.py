"""Fitness of a recording for analysis: one pass over its raw samples in bounded memory, a sentence for every flaw.

`watched`, the entry point: recordings that are inspected while an analysis reads them; `stream`: the inspection itself;
`findings`: its results; `grouped`: those of many stations; `pieces`: the samples in pieces of equal length.

One file per question: `edges` saturated, `bits` stuck or coarse, `wraps` jumps of 2^n, `repeats` rows sent twice,
`copies` two rates, `twins` one sensor in two channels, `counters` a time for a sensor, `stalls` runs that stand still,
`jumps` outliers and sharp steps, `levels` and `changes` steps and noise, `plausibility` wrong unit or rate.
`raw_flaws`, `time_flaws` and `wording` put them into words.
"""
