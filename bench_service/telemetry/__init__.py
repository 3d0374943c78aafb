"""Records of the service's own work: log context, traces, counts, audit trail."""
