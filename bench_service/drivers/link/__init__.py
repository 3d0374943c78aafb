"""Lines to devices: addresses, transports, one thread a device, and streams of frames. Knows no protocol."""
