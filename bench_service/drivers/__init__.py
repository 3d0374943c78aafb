"""Things that become a bench: the simulated one now, real devices beside it. One file a maker and device."""
