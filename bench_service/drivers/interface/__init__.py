"""INTERFACE of device drivers: sections of a bench file, what a driver is given, what it gives, and their registry.

A driver of a laboratory's own imports this package and `procedures.bench` (see docs/add-a-device.md).
"""
