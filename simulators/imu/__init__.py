"""The simulated unit: from true motion to integer counts."""
