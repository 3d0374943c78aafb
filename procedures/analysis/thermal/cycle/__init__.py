"""The thermal cycle as a whole: series, runs, forms of the correction, gyros, traces, results and their limits."""
