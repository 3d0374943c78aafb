"""Pure numbers and value types: numpy and scipy only. Lowest layer of `procedures`; knows no device, no file, no
clock.
"""
