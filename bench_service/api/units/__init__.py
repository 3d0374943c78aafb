"""Units over HTTP: their records, calibrations and corrections."""
