"""Digital calibration certificates, DCC 3.3.0 with D-SI 2.2.1: made of an exported calibration, signed, checked."""
