"""Tables of commands for a terminal: jobs, results, campaigns."""
