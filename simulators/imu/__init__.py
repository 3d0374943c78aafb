"""Simulated inertial unit: from true motion to integer counts."""
