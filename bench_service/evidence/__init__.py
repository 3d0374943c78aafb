"""Evidence: recordings, and the results, calibrations and corrections that analyses make of them. Needs no bench."""
