#!/usr/bin/env bash
# minimalmodbus sends some set points one step too low.
#
# Guess: write_register(address, value, number_of_decimals=2) sends 100 * value, rounded to the nearest
# whole number, so a chamber asked for 0.29 receives 29.
# Version: minimalmodbus 2.1.1 with pyserial 3.5 (Python 3.11).
# Behaviour: the product is cut towards zero, not rounded. 0.29 * 100 is 28.999999999999996, so 28 is
# sent. 1146 of the 20000 values from -100.00 to 99.99 are sent one step too near to zero. One decimal
# has no such value when the value is written with one decimal itself, but 0.1 + 0.7 is sent as 7.
# Round first, and send whole numbers.
# Output seen (the device repeats what it receives):
#   0.29 with two decimals: register  28
#  -0.57 with two decimals: register -56
#   0.1 + 0.7 with one decimal: register 7
#   0.30 with two decimals: register  30
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    minimalmodbus==2.1.1 pyserial==3.5
"$folder/venv/bin/python" - <<'PY'
import os
import sys
import threading

import minimalmodbus

device, port = os.openpty()
received = []


def repeat():
    # The answer to function 6 (write a single register) is the request itself.
    while True:
        request = b""
        while len(request) < 8:
            request += os.read(device, 8 - len(request))
        received.append(int.from_bytes(request[4:6], "big", signed=True))
        os.write(device, request)


threading.Thread(target=repeat, daemon=True).start()
chamber = minimalmodbus.Instrument(os.ttyname(port), 1)
chamber.serial.timeout = 2
for text, value, decimals in (("0.29 with two decimals", 0.29, 2), ("-0.57 with two decimals", -0.57, 2),
                              ("0.1 + 0.7 with one decimal", 0.1 + 0.7, 1), ("0.30 with two decimals", 0.30, 2)):
    chamber.write_register(0, value, number_of_decimals=decimals, functioncode=6, signed=True)
    print(f"{text}: register {received[-1]}")
sys.exit(0 if received == [28, -56, 7, 30] else "the behaviour has changed")
PY
