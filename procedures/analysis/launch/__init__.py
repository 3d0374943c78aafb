"""What recordings of a unit at rest say of its noise: launches analysed from raw counts to Tables 4.1 and 4.2."""
