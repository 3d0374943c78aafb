#!/usr/bin/env bash
# The simulated supply of instro forgets that its protection has tripped when the output is switched on.
#
# Guess: after an over-voltage trip OUTP ON is refused, or does nothing, until OUTP:PROT:CLE clears the latch.
# Version: instro 1.22.0 (Python 3.11).
# Behaviour: OUTP ON clears the latch by itself, leaves no error in the queue, and the output is on again. So a test of
# "a trip stays until a person has looked" passes against this server only if the driver asks OUTP:PROT:TRIP? before it
# switches on. A driver that relies on the supply to refuse is not found out.
# Output seen:
#   after the trip:  tripped 1, output 0
#   OUTP ON, error:  0,"No error"
#   after OUTP ON:   tripped 0, output 1
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check instro==1.22.0
"$folder/venv/bin/python" - <<'PY'
import logging
import sys

from instro.psu.scpi_sim_server import SimulatedPSU

logging.disable(logging.ERROR)
supply = SimulatedPSU(num_channels=1)
ask = supply.process_scpi_command
for statement in ("VOLT 12", "CURR 1", "VOLT:PROT 12", "OUTP ON"):
    ask(statement)
# An outside source raises the terminals above the protection level, as a motor that brakes does.
supply.channels[0].load.emf = 30.0
supply.channels[0].overvoltage_protection_level = 11.0
ask("VOLT:PROT:STAT ON")
ask("MEAS:VOLT?")
while not ask("SYST:ERR?").startswith("0"):
    continue
before = (ask("OUTP:PROT:TRIP?"), ask("OUTP?"))
supply.channels[0].load.emf = 0.0
supply.channels[0].overvoltage_protection_level = 20.0
ask("OUTP ON")
error = ask("SYST:ERR?")
after = (ask("OUTP:PROT:TRIP?"), ask("OUTP?"))
print(f"after the trip:  tripped {before[0]}, output {before[1]}")
print(f"OUTP ON, error:  {error}")
print(f"after OUTP ON:   tripped {after[0]}, output {after[1]}")
sys.exit(0 if (before, error[:1], after) == ((1, 0), "0", (0, 1)) else "the behaviour has changed")
PY
