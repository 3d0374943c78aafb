"""Tables and figures of results, for people: built from what `analysis` found, shown by procedures and methods."""
