"""The person at a simulated bench: what no device can do is done when asked for, in some minutes of bench time."""
