"""Which orientations of the table make a calibration surest in a given time: a search, and what it is measured by."""
