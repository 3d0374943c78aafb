"""Jobs, queues and reservations in SQL."""
