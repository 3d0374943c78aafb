"""Search for the orientations of the table that make a calibration surest in a given time."""
