"""Drivers that make a bench: the simulated one, and real devices by a bench file. One file for each maker and
device.
"""
