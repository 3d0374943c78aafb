"""Report of a result for a reader: tables and figures as plain data; the service draws them."""

from dataclasses import dataclass, field

Cell = str | float | int | None


@dataclass(frozen=True)
class Table:
    """Table of a report; a float is printed with six significant digits, None as a dash."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""


@dataclass(frozen=True)
class Series:
    """Line or set of marks. `error` are half-lengths of error bars; it and `upper` are as long as `y`, or empty."""

    name: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    error: tuple[float, ...] = ()
    style: str = "points"
    """"points", "line", "line_points", "reference" (a thin dashed line) or "band" (the area from `y` to `upper`)."""
    upper: tuple[float, ...] = ()


@dataclass(frozen=True)
class Figure:
    """Plot of a report as data: axes, series, and a caption in `note`."""

    title: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    x_log: bool = False
    y_log: bool = False
    note: str = ""


@dataclass(frozen=True)
class Report:
    """Sections in the order a reader meets them, after verdict, checks and warnings; `summary` stands before them."""

    summary: str = ""
    sections: tuple[Table | Figure, ...] = field(default=())
