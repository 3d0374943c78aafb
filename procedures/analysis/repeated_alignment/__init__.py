"""Initial alignment over and over at known attitudes: the errors to expect, and the errors found."""
