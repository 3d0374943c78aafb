"""Thermal chamber and the heat of the unit inside it. Shares no code with the analysis of the thermal cycle."""
