"""Dynamic response of gyros: gain and delay of their samples against the table's encoder, from sinusoidal motion."""
