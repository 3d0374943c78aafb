"""Jobs from request to end: planning, the queue of a bench, dispatching, retries. Knows no HTTP and no SQL."""
