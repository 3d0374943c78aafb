"""each triad's calibration as a row of its own, its coefficients stored once, and what people decided about it

Revision: 0008, after 0007
"""

import secrets
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from math import sqrt
from typing import Any
from uuid import UUID

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None

ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
MOMENT = sa.DateTime(timezone=True)
DOCUMENT = sa.JSON(none_as_null=True)
AT_ONCE = 20
"""Documents in memory."""
NAMES = tuple(name for i in (1, 2, 3) for name in (f"b_{'xyz'[i - 1]}", f"K{i}1", f"K{i}2", f"K{i}3"))
NUMBERS = ("output_unit", "input_unit", "bias", "matrix", "covariance", "model")
"""Fields of a calibration in a document that are null there, and stored in its row."""


def upgrade() -> None:
    for table in ("calibrations", "result_calibrations"):
        op.execute(f"CREATE TABLE {table}_0007 AS SELECT * FROM {table}")
    op.drop_table("result_calibrations")
    op.drop_table("calibrations")
    _create_tables()
    ids = _carry_calibrations()
    _carry_lineage(ids)
    _strip_contexts("jobs", ids)
    _strip_contexts("results", ids)
    for table in ("result_calibrations", "calibrations"):
        op.drop_table(f"{table}_0007")


def _create_tables() -> None:
    op.create_table(
        "calibrations",
        sa.Column("id", ID, nullable=False),
        sa.Column("unit", sa.String(), nullable=False),
        sa.Column("triad", sa.String(), nullable=False),
        sa.Column("method", sa.String(), nullable=False),
        sa.Column("origin", sa.String(), nullable=False),
        sa.Column("result_id", ID, nullable=True),
        sa.Column("made_at", MOMENT, nullable=False),
        sa.Column("simulated", sa.Boolean(), nullable=False),
        sa.Column("output_unit", sa.String(), nullable=False),
        sa.Column("input_unit", sa.String(), nullable=False),
        sa.Column("model", sa.String(), nullable=False),
        sa.Column("correlations", DOCUMENT, nullable=False),
        sa.Column("is_current", sa.Boolean(), nullable=False),
        sa.Column("by_rule", sa.Boolean(), nullable=False),
        sa.Column("approval", sa.String(), nullable=False),
        sa.Column("valid_from", MOMENT, nullable=True),
        sa.Column("valid_until", MOMENT, nullable=True),
        sa.ForeignKeyConstraint(["result_id"], ["results.id"], name=op.f("fk_calibrations_result_id_results")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_calibrations")),
    )
    op.create_index("ix_calibrations_unit_id", "calibrations", ["unit", "id"])
    op.create_index("uq_calibrations_result_triad", "calibrations", ["result_id", "triad"], unique=True)
    current = sa.text("is_current")
    op.create_index(
        "uq_calibrations_current_unit_triad",
        "calibrations",
        ["unit", "triad"],
        unique=True,
        sqlite_where=current,
        postgresql_where=current,
    )
    op.create_table(
        "coefficients",
        sa.Column("calibration_id", ID, nullable=False),
        sa.Column("position", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("value", sa.Float(53), nullable=False),
        sa.Column("unit", sa.String(), nullable=False),
        sa.Column("standard_uncertainty", sa.Float(53), nullable=False),
        sa.ForeignKeyConstraint(
            ["calibration_id"], ["calibrations.id"], name=op.f("fk_coefficients_calibration_id_calibrations")
        ),
        sa.PrimaryKeyConstraint("calibration_id", "position", name=op.f("pk_coefficients")),
    )
    op.create_table(
        "calibration_decisions",
        sa.Column("id", ID, nullable=False),
        sa.Column("calibration_id", ID, nullable=False),
        sa.Column("act", sa.String(), nullable=False),
        sa.Column("at", MOMENT, nullable=False),
        sa.Column("by", sa.String(), nullable=False),
        sa.Column("proven", sa.Boolean(), nullable=False),
        sa.Column("remark", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(
            ["calibration_id"], ["calibrations.id"], name=op.f("fk_calibration_decisions_calibration_id_calibrations")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_calibration_decisions")),
    )
    op.create_index("ix_calibration_decisions_calibration_id_id", "calibration_decisions", ["calibration_id", "id"])
    _create_lineage()


def _create_lineage() -> None:
    op.create_table(
        "result_calibrations",
        sa.Column("result_id", ID, nullable=False),
        sa.Column("position", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("calibration_id", ID, nullable=False),
        sa.ForeignKeyConstraint(
            ["calibration_id"], ["calibrations.id"], name=op.f("fk_result_calibrations_calibration_id_calibrations")
        ),
        sa.ForeignKeyConstraint(["result_id"], ["results.id"], name=op.f("fk_result_calibrations_result_id_results")),
        sa.PrimaryKeyConstraint("result_id", "position", name=op.f("pk_result_calibrations")),
    )
    op.create_index("ix_result_calibrations_calibration_id", "result_calibrations", ["calibration_id"])


def _table(name: str, *columns: "str | sa.Column[Any]") -> sa.TableClause:
    return sa.table(name, *(sa.column(c) if isinstance(c, str) else sa.column(c.name, c.type) for c in columns))


_RESULTS = _table("results", sa.Column("id", sa.String), "name", "verdict", sa.Column("document", DOCUMENT), "job_id")
_QUANTITIES = _table("result_quantities", "result_id", "name")


def _pages(table: sa.TableClause) -> Iterator[Sequence[Any]]:
    """Rows of a table by their ids, some at a time."""
    query, last = sa.select(table).order_by(table.c.id).limit(AT_ONCE), ""
    while found := op.get_bind().execute(query.where(table.c.id > last)).all():
        yield found
        last = found[-1].id


def _carry_calibrations() -> dict[str, list[tuple[str, str]]]:
    """Make one row a triad of each old row, oldest first; the old id, to (triad, new id) of each.

    The first triad of an old row keeps its id, so that an id that a client remembers still names a calibration. What
    was current stays so; a triad that the current row lacked (whole turns gave the gyros alone) gets its newest
    calibration that a passed job gave.
    """
    bind = op.get_bind()
    meta = sa.MetaData()
    new, coefficients = (sa.Table(name, meta, autoload_with=bind) for name in ("calibrations", "coefficients"))
    columns = ("unit", "result_id", sa.Column("made_at", MOMENT), sa.Column("triads", DOCUMENT))
    flags = (sa.Column("is_current", sa.Boolean), sa.Column("simulated", sa.Boolean))
    old = _table("calibrations_0007", sa.Column("id", sa.String), *columns, *flags)
    ids: dict[str, list[tuple[str, str]]] = {}
    fallback: dict[tuple[str, str], str] = {}
    for page in _pages(old):
        for row in page:
            result = bind.execute(sa.select(_RESULTS).where(_RESULTS.c.id == row.result_id)).one()
            gave = _gave_verdict(result)
            ids[row.id] = []
            for number, triad in enumerate(row.triads):
                made = row.id if number == 0 else _id_of(row.made_at)
                ids[row.id].append((triad["triad"], made))
                bind.execute(new.insert().values(**_row_of(made, row, result.name, triad)))
                bind.execute(coefficients.insert(), _coefficients(made, triad))
                if result.verdict == "pass" and gave:
                    fallback[row.unit, triad["triad"]] = made
            _strip_result(result, row.triads)
    has = {(unit, triad) for unit, triad in bind.execute(sa.select(new.c.unit, new.c.triad).where(new.c.is_current))}
    for key, made in fallback.items():
        if key not in has:
            bind.execute(new.update().where(new.c.id == made).values(is_current=True, by_rule=True))
    return ids


def _gave_verdict(result: Any) -> bool:
    """Whether the result is the one that gave its job the verdict: no second analysis, no method."""
    if result.job_id is None:
        return False
    jobs = _table("jobs", "id", "result_id")
    return op.get_bind().scalar(sa.select(jobs.c.result_id).where(jobs.c.id == result.job_id)) == result.id


def _row_of(made: str, row: Any, method: str, triad: Mapping[str, Any]) -> dict[str, Any]:
    sd = [sqrt(triad["covariance"][i][i]) for i in range(12)]
    correlations = [
        triad["covariance"][i][j] / (sd[i] * sd[j]) if sd[i] > 0.0 and sd[j] > 0.0 else 0.0
        for i in range(12)
        for j in range(i)
    ]
    return {
        "id": made,
        "unit": row.unit,
        "triad": triad["triad"],
        "method": method,
        "origin": "",
        "result_id": row.result_id,
        "made_at": _utc(row.made_at),
        "simulated": row.simulated,
        "output_unit": triad["output_unit"],
        "input_unit": triad["input_unit"],
        "model": triad.get("model", "linear"),
        "correlations": correlations,
        "is_current": row.is_current,
        "by_rule": row.is_current,
        "approval": "open",
        "valid_from": None,
        "valid_until": None,
    }


def _coefficients(made: str, triad: Mapping[str, Any]) -> list[dict[str, Any]]:
    found = _numbers(triad)
    return [
        {
            "calibration_id": made,
            "position": position,
            "name": name,
            "value": value,
            "unit": unit,
            "standard_uncertainty": sd,
        }
        for position, (name, (value, unit, sd)) in enumerate(found.items())
    ]


def _numbers(triad: Mapping[str, Any]) -> dict[str, tuple[float, str, float]]:
    """Value, unit and standard uncertainty of each coefficient by its name."""
    output, given = triad["output_unit"], triad["input_unit"]
    units = (output, *("1" if output == given else f"{output}/({given})",) * 3) * 3
    values = [x for b, row in zip(triad["bias"], triad["matrix"], strict=True) for x in (b, *row)]
    sds = [sqrt(triad["covariance"][i][i]) for i in range(12)]
    return dict(zip(NAMES, zip(values, units, sds, strict=True), strict=True))


def _strip_result(result: Any, triads: Sequence[Mapping[str, Any]]) -> None:
    """Take from a result's document and numbers what its calibrations have."""
    known = {f"{t['triad']}.{name}": number for t in triads for name, number in _numbers(t).items()}
    taken: set[str] = set()
    document = _stripped(result.document, triads, known, taken)
    op.get_bind().execute(_RESULTS.update().where(_RESULTS.c.id == result.id).values(document=document))
    doomed = (_QUANTITIES.c.result_id == result.id) & _QUANTITIES.c.name.in_(taken)
    op.get_bind().execute(_QUANTITIES.delete().where(doomed))


def _stripped(
    node: Any, triads: Sequence[Mapping[str, Any]], known: Mapping[str, tuple[float, str, float]], taken: set[str]
) -> Any:
    if isinstance(node, list):
        return [_stripped(child, triads, known, taken) for child in node] if _nested(node) else node
    if not isinstance(node, Mapping):
        return node
    if any(node == triad for triad in triads):
        return {key: None if key in NUMBERS else value for key, value in node.items()}
    number = (node.get("estimate"), node.get("unit"), node.get("standard_uncertainty"))
    found = {key: _stripped(value, triads, known, taken) for key, value in node.items()}
    if isinstance(node.get("name"), str) and known.get(node["name"]) == number:
        taken.add(node["name"])
        found |= dict.fromkeys(("estimate", "unit", "standard_uncertainty"))
    return found


def _nested(node: Sequence[Any]) -> bool:
    return bool(node) and isinstance(node[0], Mapping | list)


def _carry_lineage(ids: Mapping[str, list[tuple[str, str]]]) -> None:
    """A result that used an old row used each of its triads."""
    bind = op.get_bind()
    columns = ("result_id", "position", "calibration_id")
    old, new = _table("result_calibrations_0007", *columns), _table("result_calibrations", *columns)
    positions: dict[str, int] = {}
    for row in bind.execute(sa.select(old).order_by(old.c.result_id, old.c.position)).all():
        for _, made in ids[row.calibration_id]:
            position = positions.get(row.result_id, 0)
            positions[row.result_id] = position + 1
            bind.execute(new.insert().values(result_id=row.result_id, position=position, calibration_id=made))


def _strip_contexts(name: str, ids: Mapping[str, list[tuple[str, str]]]) -> None:
    """A stored context names the calibrations that were in use, by their ids, and no longer holds them."""
    table = _table(name, sa.Column("id", sa.String), sa.Column("context", DOCUMENT))
    for page in _pages(table):
        for row in page:
            unit = (row.context or {}).get("unit") or {}
            used = ids.get(unit.get("calibration_id") or "")
            if used is None:
                continue
            kept = {key: value for key, value in unit.items() if key not in ("calibration_id", "calibrations")}
            context = {**row.context, "unit": {**kept, "calibration_ids": [made for _, made in used]}}
            op.get_bind().execute(table.update().where(table.c.id == row.id).values(context=context))


def _utc(at: datetime) -> datetime:
    """The moment with its zone, which SQLite does not return."""
    return at if at.tzinfo is not None else at.replace(tzinfo=UTC)


def _id_of(at: datetime) -> str:
    """A UUID of version 7 made at a moment."""
    bits = (int(_utc(at).timestamp() * 1000) << 80) | secrets.randbits(80)
    bits = (bits & ~(0xF << 76)) | (0x7 << 76)
    bits = (bits & ~(0x3 << 62)) | (0x2 << 62)
    return str(UUID(int=bits))


def downgrade() -> None:
    """Join the triads of a result again. Entered calibrations and decisions have no place in the older tables."""
    tables = ("calibration_decisions", "result_calibrations", "coefficients", "calibrations")
    for table in tables[1:]:
        op.execute(f"CREATE TABLE {table}_0008 AS SELECT * FROM {table}")
    for table in tables:
        op.drop_table(table)
    _create_old_tables()
    triads = _triads()
    sets = _join_triads(triads)
    columns = ("result_id", "position", "calibration_id")
    lineage, old = _table("result_calibrations_0008", *columns), _table("result_calibrations", *columns)
    used: dict[str, dict[str, None]] = {}
    for row in op.get_bind().execute(sa.select(lineage).order_by(lineage.c.result_id, lineage.c.position)):
        if row.calibration_id in sets:
            used.setdefault(row.result_id, {})[sets[row.calibration_id]] = None
    rows: list[dict[str, Any]] = [
        {"result_id": result, "position": position, "calibration_id": calibration}
        for result, found in used.items()
        for position, calibration in enumerate(found)
    ]
    if rows:
        op.get_bind().execute(old.insert(), rows)
    for name in ("jobs", "results"):
        _fill_contexts(name, triads, sets)
    for table in tables[1:]:
        op.drop_table(f"{table}_0008")


def _create_old_tables() -> None:
    op.create_table(
        "calibrations",
        sa.Column("id", ID, nullable=False),
        sa.Column("unit", sa.String(), nullable=False),
        sa.Column("result_id", ID, nullable=False),
        sa.Column("made_at", MOMENT, nullable=False),
        sa.Column("is_current", sa.Boolean(), nullable=False),
        sa.Column("triads", DOCUMENT, nullable=False),
        sa.Column("simulated", sa.Boolean(), nullable=False),
        sa.ForeignKeyConstraint(["result_id"], ["results.id"], name=op.f("fk_calibrations_result_id_results")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_calibrations")),
    )
    op.create_index("ix_calibrations_unit_id", "calibrations", ["unit", "id"])
    current = sa.text("is_current")
    op.create_index(
        "uq_calibrations_current_unit",
        "calibrations",
        ["unit"],
        unique=True,
        sqlite_where=current,
        postgresql_where=current,
    )
    _create_lineage()


def _triads() -> dict[str, tuple[Any, dict[str, Any]]]:
    """Each calibration's row and its triad as JSON, by its id."""
    bind = op.get_bind()
    numbers: dict[str, list[Any]] = {}
    coefficients = _table("coefficients_0008", "calibration_id", "position", "value", "standard_uncertainty")
    for row in bind.execute(sa.select(coefficients).order_by(coefficients.c.calibration_id, coefficients.c.position)):
        numbers.setdefault(row.calibration_id, []).append(row)
    names = ("unit", "triad", "result_id", "output_unit", "input_unit", "model")
    columns = (sa.Column("made_at", MOMENT), sa.Column("correlations", DOCUMENT))
    flags = (sa.Column("is_current", sa.Boolean), sa.Column("simulated", sa.Boolean))
    table = _table("calibrations_0008", sa.Column("id", sa.String), *names, *columns, *flags)
    found = bind.execute(sa.select(table).order_by(table.c.id)).all()
    return {row.id: (row, _triad_of(row, numbers[row.id])) for row in found}


def _triad_of(row: Any, numbers: Sequence[Any]) -> dict[str, Any]:
    sd = [n.standard_uncertainty for n in numbers]
    covariance = [[sd[i] ** 2 if i == j else 0.0 for j in range(12)] for i in range(12)]
    pairs = [(i, j) for i in range(12) for j in range(i)]
    for (i, j), correlation in zip(pairs, row.correlations, strict=True):
        covariance[i][j] = covariance[j][i] = correlation * sd[i] * sd[j]
    values = [n.value for n in numbers]
    return {
        "triad": row.triad,
        "output_unit": row.output_unit,
        "input_unit": row.input_unit,
        "bias": values[::4],
        "matrix": [values[i + 1 : i + 4] for i in (0, 4, 8)],
        "covariance": covariance,
        "model": row.model,
    }


def _join_triads(triads: Mapping[str, tuple[Any, dict[str, Any]]]) -> dict[str, str]:
    """One row a result, gyros first, with the numbers in its document again; each id, to the id of its row."""
    bind = op.get_bind()
    columns = ("id", "unit", "result_id", "is_current", "simulated")
    old = _table("calibrations", *columns, sa.Column("made_at", MOMENT), sa.Column("triads", DOCUMENT))
    by_result: dict[str, list[tuple[Any, dict[str, Any]]]] = {}
    for row, triad in sorted(triads.values(), key=lambda found: found[1]["triad"], reverse=True):
        if row.result_id is not None:
            by_result.setdefault(row.result_id, []).append((row, triad))
    current = {row.unit: row.result_id for row, _ in sorted(triads.values(), key=lambda f: f[0].id) if row.is_current}
    sets: dict[str, str] = {}
    for result_id, members in by_result.items():
        first = members[0][0]
        sets |= {row.id: first.id for row, _ in members}
        bind.execute(
            old.insert().values(
                id=first.id,
                unit=first.unit,
                result_id=result_id,
                made_at=_utc(first.made_at),
                is_current=current.get(first.unit) == result_id,
                triads=[triad for _, triad in members],
                simulated=first.simulated,
            )
        )
        _fill_result(result_id, {triad["triad"]: triad for _, triad in members})
    return sets


def _fill_result(result_id: str, triads: Mapping[str, Mapping[str, Any]]) -> None:
    bind = op.get_bind()
    known = {f"{t['triad']}.{name}": number for t in triads.values() for name, number in _numbers(t).items()}
    result = bind.execute(sa.select(_RESULTS).where(_RESULTS.c.id == result_id)).one()
    given: set[str] = set()
    document = _filled(result.document, triads, known, given)
    bind.execute(_RESULTS.update().where(_RESULTS.c.id == result_id).values(document=document))
    numbers = _table("result_quantities", "result_id", "name", "value", "unit", "standard_uncertainty")
    for name in sorted(given):
        value, unit, sd = known[name]
        row = {"result_id": result_id, "name": name, "value": value, "unit": unit, "standard_uncertainty": sd}
        bind.execute(numbers.insert().values(**row))


def _filled(
    node: Any,
    triads: Mapping[str, Mapping[str, Any]],
    known: Mapping[str, tuple[float, str, float]],
    given: set[str],
) -> Any:
    """The opposite of `_stripped`."""
    if isinstance(node, list):
        return [_filled(child, triads, known, given) for child in node] if _nested(node) else node
    if not isinstance(node, Mapping):
        return node
    if node.get("triad") in triads and "covariance" in node and node["covariance"] is None:
        return {key: triads[node["triad"]][key] for key in node}
    found = {key: _filled(value, triads, known, given) for key, value in node.items()}
    if isinstance(node.get("name"), str) and node["name"] in known and "estimate" in node and node["estimate"] is None:
        given.add(node["name"])
        found |= dict(zip(("estimate", "unit", "standard_uncertainty"), known[node["name"]], strict=True))
    return found


def _fill_contexts(name: str, triads: Mapping[str, tuple[Any, dict[str, Any]]], sets: Mapping[str, str]) -> None:
    table = _table(name, sa.Column("id", sa.String), sa.Column("context", DOCUMENT))
    for page in _pages(table):
        for row in page:
            unit = (row.context or {}).get("unit") or {}
            used = unit.get("calibration_ids") or []
            if not used:
                continue
            kept = {key: value for key, value in unit.items() if key not in ("calibration_ids", "withheld")}
            kept |= {"calibration_id": sets.get(used[0]), "calibrations": [triads[made][1] for made in used]}
            context = {**row.context, "unit": kept}
            op.get_bind().execute(table.update().where(table.c.id == row.id).values(context=context))
