"""Evidence without a bench: recordings, and the results, calibrations and corrections that analyses make of them."""
