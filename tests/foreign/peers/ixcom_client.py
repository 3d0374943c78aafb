"""iMAR's own client at an iXCOM unit on a port of this machine: identity, rate, 200 messages; prints JSON."""

import json
import sys
import time

import ixcom

client = ixcom.Client("127.0.0.1", int(sys.argv[1]))
found = []


def heard(message, from_device=None):
    if message.header.msgID == 0:
        found.append(
            (
                message.header.frameCounter,
                message.header.get_time(),
                [float(v) for v in message.payload.data["acc"]],
                [float(v) for v in message.payload.data["omg"]],
                message.bottom.gStatus,
            )
        )


client.add_callback(lambda message, *_: heard(message))
client.open_channel(0)
told = {
    "serial": client.get_parameter(2).payload.data["str"].split(b"\0")[0].decode(),
    "timing": client.get_parameter(11).payload.data["maintiming"],
}
client.add_log_with_rate(0, float(sys.argv[2]))
until = time.monotonic() + 20.0
while len(found) < 200 and time.monotonic() < until:
    time.sleep(0.01)
client.clear_all()
client.close_channel()
client.stop()
told["messages"] = found[:200]
print(json.dumps(told))
