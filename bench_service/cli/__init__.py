"""The command line, ``bench``: the same API in other words. Exit code 0 pass, 1 fail, 2 error."""
