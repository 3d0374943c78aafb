"""IMURAW frames by iMAR's own encoder, as hexadecimal lines: counter, status and payload are given on the input."""

import json
import sys

from ixcom import data

for line in sys.stdin:
    given = json.loads(line)
    message = data.getMessageWithID(0)
    message.header.frameCounter = given["counter"]
    message.header.set_time(given["time_s"])
    message.payload.data["acc"] = given["acc"]
    message.payload.data["omg"] = given["omg"]
    message.bottom.gStatus = given["status"]
    print(bytes(message.to_bytes()).hex(), flush=True)
