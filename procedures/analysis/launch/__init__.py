"""Noise of a unit from recordings at rest: launches analysed from raw counts to Tables 4.1 and 4.2."""
