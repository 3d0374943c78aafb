"""basil-daq's own driver of a Weiss LabEvent over its own socket layer, at a port of this machine; prints JSON."""

import json
import sys

from basil.HL.weiss_labevent import weissLabEvent
from basil.TL.Socket import Socket

line = Socket(
    {
        "name": "line",
        "type": "Socket",
        "init": {
            "address": "127.0.0.1",
            "port": int(sys.argv[1]),
            "encoding": "latin-1",
            "write_termination": "\r",
            "read_termination": "\r\n",
            "query_delay": 0.05,
        },
    }
)
line.init()
chamber = weissLabEvent(line, {"name": "chamber", "type": "weiss_labevent", "init": {}})
chamber.init()
told = {"type": chamber.get_info(), "idle": chamber.get_status(), "air": chamber.get_temperature()}
chamber.set_temperature(41.25)
told["set_point"] = chamber.get_temperature_setpoint()
chamber.start_manual_mode()
told["running"] = chamber.get_status()
chamber.set_air_dryer(True)
told["dryer"] = chamber.get_air_dryer()
told["compressed_air"] = chamber.get_compressed_air()
chamber.stop_manual_mode()
told["stopped"] = chamber.get_status()
line.close()
print(json.dumps(told))
