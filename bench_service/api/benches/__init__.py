"""Benches over HTTP: their state, their queues and their stops."""
