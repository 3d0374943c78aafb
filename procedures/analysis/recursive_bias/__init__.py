"""A constant bias estimated measurement by measurement: how sure of it we are by now, when a dwell is long enough."""
