"""Drivers of devices: each implements an interface of `procedures.bench` over a protocol and a line."""
