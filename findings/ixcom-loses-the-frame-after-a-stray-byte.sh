#!/usr/bin/env bash
# The iXCOM parser of the maker loses a right frame when one stray byte 0x7E comes before it.
#
# Guess: a stray sync byte costs nothing; the parser looks for the next sync byte, as the frame behind it is whole and
# its CRC is right.
# Version: ixcom 1.3.10 (Python 3.11).
# Behaviour: the parser takes the stray byte for a beginning, reads a length out of the next frame's header, and throws
# away all that it has read when that length cannot be; it does not look again within those bytes. The frame is lost
# without a word, and so the next one after it may be. Count frames by their counter, and look for the sync byte again
# inside what was rejected.
# Output seen:
#   three frames:                     3 found, counters [1, 2, 3]
#   0x7E before the second:           2 found, counters [1, 3]
#   0x00 before the second:           3 found, counters [1, 2, 3]
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check ixcom==1.3.10
"$folder/venv/bin/python" - <<'PY'
import sys

from ixcom import data
from ixcom.parser import MessageSearcher


def frame(counter):
    message = data.getMessageWithID(0)
    message.header.frameCounter = counter
    message.payload.data["acc"], message.payload.data["omg"] = [0.0, 9.81, 0.0], [0.0, 0.0, 0.0]
    return bytes(message.to_bytes())


def found(stream):
    counters, searcher = [], MessageSearcher()
    searcher.add_callback(lambda message: counters.append(bytes(message)[2]))
    searcher.process_bytes_python(stream)
    return counters


one, two, three = frame(1), frame(2), frame(3)
seen = [found(one + two + three), found(one + b"\x7e" + two + three), found(one + b"\x00" + two + three)]
for name, counters in zip(("three frames:", "0x7E before the second:", "0x00 before the second:"), seen):
    print(f"{name:<33} {len(counters)} found, counters {counters}")
sys.exit(0 if seen == [[1, 2, 3], [1, 3], [1, 2, 3]] else "the behaviour has changed")
PY
