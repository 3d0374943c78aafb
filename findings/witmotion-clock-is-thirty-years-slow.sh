#!/usr/bin/env bash
# The driver for WitMotion units dates a record thirty years back, and a month and a day ahead.
#
# Guess: the time message of a unit set to 2024-05-17 10:20:30.250 comes out as that time.
# Version: witmotion 0.0.1.dev0 (Python 3.11). The bytes are those of the maker's protocol: 0x55 0x50, year less 2000,
# month, day, hour, minute, second, milliseconds (two bytes, low one first), sum of all.
# Behaviour: the year counts from 1970, and month and day are taken for numbers that begin at 0. The time of day and
# the differences within a month are right. A record of December, or of a day whose next one the following month lacks
# (30 March would be 31 April), raises ValueError. And one g is 9.8 m/s^2 in it, 0.07 % less than the standard gravity.
# Output seen:
#   sent 2024-05-17 10:20:30.250, read 1994-06-18 10:20:30.250
#   sent 2024-12-02, read: ValueError
#   one g (2048 counts) reads 9.8000 m/s^2
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check --no-deps witmotion==0.0.1.dev0 pyserial==3.5
"$folder/venv/bin/python" - <<'PY'
import struct
import sys
from datetime import datetime, timezone

from witmotion.protocol import AccelerationMessage, TimeMessage


def sent(moment):
    """Eight bytes of the time message, between its two first and its sum."""
    date = moment.year - 2000, moment.month, moment.day
    return struct.pack("<6BH", *date, moment.hour, moment.minute, moment.second, moment.microsecond // 1000)


moment = datetime(2024, 5, 17, 10, 20, 30, 250_000, tzinfo=timezone.utc)
read = datetime.fromtimestamp(TimeMessage.parse(sent(moment)).timestamp, tz=timezone.utc)
print(f"sent {moment:%Y-%m-%d %H:%M:%S}.250, read {read:%Y-%m-%d %H:%M:%S}.{read.microsecond // 1000}")
try:
    december = str(TimeMessage.parse(sent(datetime(2024, 12, 2))))
except ValueError as error:
    december = type(error).__name__
print("sent 2024-12-02, read:", december)
one_g = AccelerationMessage.parse(struct.pack("<4h", 0, 0, 32768 // 16, 2500)).a[2]
print(f"one g (2048 counts) reads {one_g:.4f} m/s^2")
same = (read.year, read.month, read.day) == (1994, 6, 18) and december == "ValueError" and abs(one_g - 9.8) < 1e-9
sys.exit(0 if same else "the behaviour has changed")
PY
