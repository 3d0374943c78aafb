"""What the service records of itself: log context, traces, counts, audit trail."""
