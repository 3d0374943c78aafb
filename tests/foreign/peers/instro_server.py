"""instro's simulated supply on a port of this machine; prints the port, serves until its input ends.

A word on the input changes it: "trip" lets its protection trip, "load 3" gives it another load [ohm].
"""

import sys

from instro.psu.scpi_sim_server import SimulatedPSU, SimulatedPSUServer

supply = SimulatedPSU(num_channels=1)
server = SimulatedPSUServer(supply, "127.0.0.1", 0)
server.start()
print(server.port, flush=True)
for line in sys.stdin:
    word, _, value = line.strip().partition(" ")
    channel = supply.channels[0]
    with server.lock:
        if word == "load":
            channel.load.resistance = float(value)
        elif word == "trip":
            channel.overvoltage_protection_level = 1.0
            channel.overvoltage_protection_enabled = True
            supply._update()
    print("done", flush=True)
server.shutdown()
