"""The precision current source of the converter's bench."""
