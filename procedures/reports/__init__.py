"""Tables and figures of results for readers, built from the results of `analysis`, shown by procedures and methods."""
