"""The thermal cycle's numbers: regimes, fits, corrections, judgement (thesis 3.2 and 4.2, paper C). Pure functions.

Temperatures are in °C as the unit's own sensors read them; the chamber is never a regressor.
"""
