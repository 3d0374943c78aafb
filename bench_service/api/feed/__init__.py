"""One stream for everything that a browser shows live, whatever number of its pages are open."""
