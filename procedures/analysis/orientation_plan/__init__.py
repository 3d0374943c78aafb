"""Search for the orientations of the table that give a calibration the least uncertainty in a given time."""
