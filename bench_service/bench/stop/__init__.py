"""The stop of a bench outside every database: its channel, its roads from elsewhere, and its way into the books."""
