"""The live state of benches: published by the process that drives one, read by all."""
