"""Drivers of devices: a port of the bench over a protocol and a line."""
