"""Served simulators: the world's devices on TCP ports, in the bytes of makers' protocols.

Shares no code with the drivers that speak the same protocols.
"""
