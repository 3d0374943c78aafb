"""Jobs: from request to end. Planning, the queue of a bench, dispatching, retries. Knows no HTTP and no SQL."""
