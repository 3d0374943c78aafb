#!/usr/bin/env bash
# A package for calibration certificates cannot be imported on a laboratory machine without internet.
#
# Guess: "import dcc_quantities" reads nothing but files of the installed packages; a schema is
# needed when a certificate is written or checked, and comes with the package, as in dcclib.
# Version: dccquantities 3.0.4 with dcc-json-toolkit 1.2.5 (Python 3.11).
# Behaviour: the import itself fetches the schema of the newest release candidate (3.4.0-rc.2) from the
# site of the PTB, unless an earlier import has cached it in the user's folder. Without a network the
# import raises ConnectionError; a time-out of the request is not set.
# This script makes name look-ups fail inside the process, so that it needs no network and gives the
# same answer with one.
# Output seen:
#   import dcc_quantities: ConnectionError
#   looked up while importing: ptb.de
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    dccquantities==3.0.4 dcc-json-toolkit==1.2.5
"$folder/venv/bin/python" - <<'PY'
import os
import socket
import sys
import tempfile

looked_up = []


def no_network(host, *args, **kwargs):
    looked_up.append(host)
    raise socket.gaierror("no network in this laboratory")


socket.getaddrinfo = no_network
with tempfile.TemporaryDirectory() as home:
    os.environ.update(HOME=home, XDG_CACHE_HOME=home)  # a user who has imported it never before
    for name in [name for name in os.environ if name.lower().endswith("_proxy")]:
        del os.environ[name]
    try:
        import dcc_quantities
    except Exception as error:
        result = type(error).__name__
    else:
        result = "done"
print("import dcc_quantities:", result)
print("looked up while importing:", ", ".join(sorted(set(looked_up))))
sys.exit(0 if result == "ConnectionError" and looked_up else "the behaviour has changed")
PY
