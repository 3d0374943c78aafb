#!/usr/bin/env bash
# cronsim and croniter disagree about a run that falls into the hour the clocks skip, and one loses it.
#
# Guess: "*/30 3 * * *" and "0,30 3 * * *" are two spellings of one schedule, so a nightly bench run in
# the skipped hour (03:00 to 04:00 in Kyiv on 29 March 2026) is dealt with in the same way.
# Versions: cronsim 2.8, croniter 7.0.0 (tzdata 2026.6, Python 3.11).
# Behaviour: cronsim moves the run to 04:00 for the spelling with numbers, as Debian's cron does, but for
# the spelling with a star that day has NO run: the next is 24 hours later. croniter moves both.
# In autumn croniter runs "30 3 * * *" twice, an hour apart, and cronsim once.
# Output seen:
#   spring 0,30 3 * * *   cronsim 2026-03-29 04:00   croniter 2026-03-29 04:00
#   spring */30 3 * * *   cronsim 2026-03-30 03:00   croniter 2026-03-29 04:00
#   autumn 30 3 * * *     cronsim 1 run              croniter 2 runs on 2026-10-25
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    cronsim==2.8 croniter==7.0.0 tzdata==2026.6
"$folder/venv/bin/python" - <<'PY'
import sys
from datetime import datetime
from zoneinfo import ZoneInfo

from croniter import croniter
from cronsim import CronSim

ZONE = ZoneInfo("Europe/Kyiv")


def runs(expression, start, count):
    one, other = CronSim(expression, start), croniter(expression, start)
    return [next(one) for _ in range(count)], [other.get_next(datetime) for _ in range(count)]


firsts = []
for expression in ("0,30 3 * * *", "*/30 3 * * *"):
    one, other = runs(expression, datetime(2026, 3, 28, 12, tzinfo=ZONE), 1)
    pair = tuple(f"{times[0]:%Y-%m-%d %H:%M}" for times in (one, other))
    firsts.append(pair)
    print(f"spring {expression:14} cronsim {pair[0]}   croniter {pair[1]}")
autumn = runs("30 3 * * *", datetime(2026, 10, 24, 12, tzinfo=ZONE), 4)
counts = [sum(f"{time:%Y-%m-%d}" == "2026-10-25" for time in times) for times in autumn]
print(f"autumn {'30 3 * * *':14} cronsim {counts[0]} run              croniter {counts[1]} runs on 2026-10-25")
same = (firsts == [("2026-03-29 04:00", "2026-03-29 04:00"), ("2026-03-30 03:00", "2026-03-29 04:00")]
        and counts == [1, 2])
sys.exit(0 if same else "the behaviour has changed")
PY
