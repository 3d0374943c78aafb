"""A long history made in the database itself: jobs, recordings, results and their numbers, multiplied from real ones.

One calibration is run through a service; its rows are then copied by SQL with other ids, times, units and verdicts. The
copied recordings have no chunks and no state of the simulated world: lists and pages read none.
"""

from dataclasses import dataclass

import sqlalchemy as sa

from bench_service.persistence.database import Database

UNITS = 1000
"""Units that share the history; every tenth job is of the unit `U-0`, for a long trend."""
LOTS, CUSTOMERS = 500, 37
"""Values of the two labels of a job."""
PER_JOB = 10
"""Recordings of a job."""
STEP_MS = 300_000
"""Time between two jobs [ms]."""


@dataclass(frozen=True)
class Dialect:
    """Expressions that the two databases spell differently."""

    series: str
    """A table `s(n)` of the numbers from :first up to :last."""
    hexadecimal: str
    """Digits of a number, with places {x} and {digits}."""
    moment: str
    """A moment from milliseconds {x}."""
    json: str
    """A JSON document from a text {x}."""


SQLITE = Dialect(
    "(WITH RECURSIVE s(n) AS (SELECT :first UNION ALL SELECT n + 1 FROM s WHERE n < :last) SELECT n FROM s) s",
    "printf('%0{digits}x', {x})",
    "strftime('%Y-%m-%d %H:%M:%f', ({x}) / 1000.0, 'unixepoch') || '000'",
    "{x}",
)
POSTGRES = Dialect(
    "generate_series(CAST(:first AS bigint), CAST(:last AS bigint)) AS s(n)",
    "lpad(to_hex(CAST({x} AS bigint)), {digits}, '0')",
    "to_timestamp(({x}) / 1000.0)",
    "CAST({x} AS json)",
)


def seed(database: Database, job_id: str, jobs: int, begin_ms: int, already: int = 0) -> None:
    """Multiply the rows of a job that has ended to `jobs` jobs, the first of them at `begin_ms` since 1970.

    `already`: number of jobs that an earlier call made with the same beginning, which are left as they are.
    """
    dialect = POSTGRES if database.is_postgres else SQLITE
    with database.engine.connect() as connection:
        found = sa.MetaData()
        found.reflect(
            connection, only=["jobs", "recordings", "results", "result_quantities", "result_recordings", "events"]
        )
        columns = {name: [column.name for column in table.columns] for name, table in found.tables.items()}
        recording, result = connection.execute(
            sa.text(
                "SELECT min(r.id), min(j.result_id) FROM recordings r JOIN jobs j ON j.id = r.job_id WHERE j.id = :id"
            ),
            {"id": job_id},
        ).one()
    given = {"first": already + 1, "last": jobs, "job": job_id, "recording": recording, "result": result}
    for statement in _Rows(dialect, columns, begin_ms).statements():
        with database.write() as session:
            used = {name: value for name, value in given.items() if f":{name}" in statement}
            session.execute(sa.text(statement), used)
    with database.engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
        connection.execute(sa.text("ANALYZE"))


class _Rows:
    """The statements, one table after the other."""

    def __init__(self, dialect: Dialect, columns: dict[str, list[str]], begin_ms: int) -> None:
        self._dialect = dialect
        self._columns = columns
        self._begin_ms = begin_ms

    def statements(self) -> list[str]:
        job, at = self._id("n", 0), self._at()
        unit = f"CASE WHEN n % 10 = 0 THEN 'U-0' ELSE 'U-' || (n % {UNITS}) END"
        verdict = "CASE WHEN n % 7 = 0 THEN 'fail' ELSE 'pass' END"
        pairs = (
            ('\'{"lot": "\' || (n % LOTS) || \'", "customer": "customer \' || (n % CUSTOMERS) || \'"}\'')
            .replace("LOTS", str(LOTS))
            .replace("CUSTOMERS", str(CUSTOMERS))
        )
        labels = self._dialect.json.format(x=pairs)
        moment, series = self._dialect.moment.format(x=at), self._dialect.series
        of_recording = f"(SELECT n, k FROM {series}, ({self._small(PER_JOB)}) small) s"
        jobs = {
            "id": job,
            "number": "n + 1000",
            "unit": unit,
            "created_at": moment,
            "queued_at": moment,
            "started_at": moment,
            "finished_at": self._dialect.moment.format(x=f"{at} + 60000"),
            "labels": labels,
            "verdict": verdict,
            "result_id": self._id("n", 2),
        }
        recordings = {
            "id": self._id("n", 1, "k"),
            "job_id": job,
            "unit": unit,
            "station_index": "k",
            "checkpoint": "NULL",
            "created_at": moment,
        }
        results = {"id": self._id("n", 2), "job_id": job, "unit": unit, "created_at": moment, "verdict": verdict}
        return [
            self._insert("jobs", "id = :job", jobs, series),
            self._insert("results", "id = :result", results, series),
            self._label("lot", f"'' || (n % {LOTS})", job, series),
            self._label("customer", f"'customer ' || (n % {CUSTOMERS})", job, series),
            self._insert("recordings", "id = :recording", recordings, of_recording),
            self._insert("result_quantities", "result_id = :result", {"result_id": self._id("n", 2)}, series),
            self._insert(
                "result_recordings",
                "result_id = :result AND position = 0",
                {"result_id": self._id("n", 2), "position": "k", "recording_id": self._id("n", 1, "k")},
                of_recording,
            ),
            self._insert("events", "job_id = :job AND sequence <= 3", {"job_id": job, "at": moment}, series),
        ]

    def _label(self, name: str, value: str, job: str, series: str) -> str:
        return f"INSERT INTO job_labels (job_id, name, value) SELECT {job}, '{name}', {value} FROM {series}"

    def _insert(self, table: str, template: str, changed: dict[str, str], series: str) -> str:
        names = self._columns[table]
        wanted = ", ".join(changed.get(name, f't."{name}"') for name in names)
        quoted = ", ".join(f'"{name}"' for name in names)
        return (
            f'INSERT INTO "{table}" ({quoted}) SELECT {wanted} FROM "{table}" t, {series} WHERE {_qualified(template)}'
        )

    def _at(self) -> str:
        return f"({self._begin_ms} + n * {STEP_MS})"

    def _id(self, number: str, kind: int, within: str = "0") -> str:
        """An id whose beginning is the moment, as those of the service, and which no other row has."""
        at = f"({self._at()} + {within})"
        high = self._dialect.hexadecimal.format(x=f"({at} / 65536)", digits=8)
        low = self._dialect.hexadecimal.format(x=f"({at} % 65536)", digits=4)
        tail = self._dialect.hexadecimal.format(x=f"({number} * 16 + {within})", digits=12)
        return f"{high} || '-' || {low} || '-700{kind}-8000-' || {tail}"

    def _small(self, count: int) -> str:
        return " UNION ALL ".join(f"SELECT {k} AS k" for k in range(count))


def _qualified(template: str) -> str:
    return " AND ".join(f"t.{part}" for part in template.split(" AND "))
