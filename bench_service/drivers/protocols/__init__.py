"""Protocols of makers as pure functions between bytes and values: no socket, no clock, no device."""
