"""Answers of a service whose texts hold brackets and colons, in the form that a command receives."""

EVIL = "cable [/dev/ttyS0] [red]x[/] :smile:"
BELOW = "trend of gyro.b_x over 10 results: one point beyond 3σ"
TOO_FEW = "3 earlier results, 8 are needed to judge it"
LIMIT = {"minimum": 1.0, "maximum": None, "unit": EVIL}
STEP = {
    "name": EVIL,
    "does": EVIL,
    "state": "succeeded",
    "verdict": "fail",
    "checks": [{"name": EVIL, "passed": False}, {"name": "other", "passed": True}],
    "warnings": [BELOW, TOO_FEW],
    "reason": f"why: {EVIL}",
    "started_at": "2026-01-01T00:00:00Z",
    "finished_at": "2026-01-01T00:00:00Z",
}
RUN = {
    "id": "r1",
    "campaign": EVIL,
    "unit": EVIL,
    "state": "running",
    "verdict": None,
    "steps": [{**STEP, "state": "running", "finished_at": None}],
    "waiting": f"bench stopped: {EVIL}",
    "reason": "",
    "warnings": [EVIL],
    "created_at": "2026-01-01T00:00:00Z",
}
ENDED = {**RUN, "state": "succeeded", "verdict": "fail", "steps": [STEP], "waiting": EVIL, "reason": EVIL}
JOB = {
    "id": "j1",
    "number": 1,
    "procedure": EVIL,
    "unit": EVIL,
    "state": "running",
    "verdict": None,
    "progress": {"station": 0, "stations": 1},
    "page": "/jobs/j1",
    "result": None,
    "error": None,
    "created_at": "2026-01-01T00:00:00Z",
}
JOB_ENDED = {**JOB, "state": "succeeded", "verdict": "fail", "result": "x"}
CHECK = {"name": EVIL, "passed": False, "value": 0.5, "limit": LIMIT}
RESULT = {"id": "x", "verdict": "fail", "document": {"checks": [CHECK], "warnings": [EVIL]}}
CAMPAIGN = {"name": EVIL, "shipped": False, "campaign": {"title": EVIL, "steps": [{"name": EVIL}]}}
SCHEDULE = {
    "id": "s1",
    "campaign": EVIL,
    "unit": EVIL,
    "cron": "* * * * *",
    "time_zone": EVIL,
    "next_at": None,
    "last_outcome": EVIL,
}
