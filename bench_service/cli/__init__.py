"""Command line ``bench``: a client of the same API. Exit code 0 pass, 1 fail, 2 error."""
