"""Devices on wires as a bench: assembled from a bench file, made safe by it, and compared with their register."""
