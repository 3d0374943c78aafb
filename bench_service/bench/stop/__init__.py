"""The stop of a bench outside every database: its channel, its way from other hosts, its entry into the database."""
