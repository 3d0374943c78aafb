"""Routes and schemas of units: their records, calibrations and corrections."""
