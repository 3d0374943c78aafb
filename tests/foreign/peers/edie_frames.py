"""RAWIMUSX messages in binary by NovAtel's own encoder, as hexadecimal lines, from ASCII ones on the input."""

import sys

import novatel_edie
from novatel_edie import ENCODE_FORMAT, oem

parser = oem.Parser()
parser.write(sys.stdin.read().encode("ascii"))
for message in parser:
    if not isinstance(message, novatel_edie.UnknownBytes):
        print(bytes(message.encode(ENCODE_FORMAT.BINARY).message).hex())
