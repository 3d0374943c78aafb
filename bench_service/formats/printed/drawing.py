"""Drawing of a `Figure` of the domain as SVG by matplotlib, which is loaded by the first one.

Margins are fixed and logarithmic axes have their labels and fine grid from here: laying out and typesetting them is
what takes matplotlib most of its time, and a static run has twenty plots.
"""

from io import StringIO
from math import ceil, floor, log10
from threading import Lock
from typing import TYPE_CHECKING

from procedures.core.report import Figure, Series

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE_IN = (7.2, 3.4)
MARGINS = {"left": 0.12, "right": 0.985, "bottom": 0.15, "top": 0.93}
COLOURS = ("#1f5fa8", "#c2410c", "#15803d", "#7c3aed", "#a16207", "#0e7490")
MARKS = ("o", "^", "s", "D", "v", "P")
MOST_DECADES = 12
"""Decades that a logarithmic axis shows at most: values further below its greatest one are left out."""
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
SALT = "bench"
"""Salt of the ids inside an SVG: a figure that is drawn again is the same to the byte."""
_DRAWING = Lock()
"""matplotlib's settings are global: two drawings at once would take each other's."""


def drawn_here(figure: Figure) -> str:
    """Return a figure as an SVG document, drawn by matplotlib in this process; one at a time."""
    with _DRAWING:
        return _drawn(figure)


def _drawn(figure: Figure) -> str:
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure as Canvas
    from matplotlib.ticker import MaxNLocator

    with rc_context({"svg.fonttype": "none", "svg.hashsalt": SALT, "font.size": 9, "axes.formatter.useoffset": False}):
        canvas = Canvas(figsize=SIZE_IN)
        canvas.subplots_adjust(**MARGINS)
        FigureCanvasSVG(canvas)
        axes = canvas.add_subplot()
        for index, series in enumerate(figure.series):
            _draw(axes, series, COLOURS[index % len(COLOURS)], MARKS[index % len(MARKS)])
        axes.set_xlabel(figure.x_label)
        axes.set_ylabel(figure.y_label)
        if figure.x_log:
            _logarithmic(axes, "x", [v for s in figure.series for v in s.x])
        if figure.y_log:
            _logarithmic(axes, "y", [v for s in figure.series for v in (*s.y, *s.upper)])
        marked = [v for s in figure.series if s.style in ("points", "line_points") for v in s.x]
        if marked and not figure.x_log and all(float(v).is_integer() for v in marked):  # numbers of stations, results
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.grid(visible=True, linewidth=0.4, alpha=0.7)
        if len(figure.series) > 1:
            axes.legend(fontsize=8, framealpha=0.8)
        out = StringIO()
        canvas.savefig(out, format="svg", metadata={"Date": None})
    text = out.getvalue()
    return text[text.index("<svg") :]


def _draw(axes: "Axes", series: Series, colour: str, mark: str) -> None:
    """Draw one series in its style; error bars where it has them."""
    if series.style == "reference":
        axes.plot(series.x, series.y, linestyle="--", linewidth=1.0, color="#444444", label=series.name)
        return
    if series.style == "band":
        axes.fill_between(series.x, series.y, series.upper, color=colour, alpha=0.18, linewidth=0.0, label=series.name)
        return
    line = "-" if series.style in ("line", "line_points") else "none"
    marker = "none" if series.style == "line" else mark
    axes.errorbar(
        series.x,
        series.y,
        yerr=list(series.error) or None,
        linestyle=line,
        linewidth=1.1,
        marker=marker,
        markersize=4.5,
        capsize=2.5,
        color=colour,
        label=series.name,
    )


def _logarithmic(axes: "Axes", direction: str, values: list[float]) -> None:
    """A logarithmic axis with whole decades labelled, and the fine lines of logarithmic paper in between."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    positive = [v for v in values if v > 0.0]
    if not positive:
        return
    last = ceil(log10(max(positive)) - 1e-9)
    first = max(min(floor(log10(min(positive)) + 1e-9), last - 1), last - MOST_DECADES)
    decades = [10.0**k for k in range(first, last + 1)]
    fine = [m * decade for decade in decades[:-1] for m in range(2, 10)]
    if direction == "x":
        axes.set_xscale("log")
        axes.set_xlim(decades[0], decades[-1])
        axes.vlines(fine, 0.0, 1.0, transform=axes.get_xaxis_transform(), color="#b0b0b0", linewidth=0.3, alpha=0.5)
        axis = axes.xaxis
    else:
        axes.set_yscale("log")
        axes.set_ylim(decades[0], decades[-1])
        axes.hlines(fine, 0.0, 1.0, transform=axes.get_yaxis_transform(), color="#b0b0b0", linewidth=0.3, alpha=0.5)
        axis = axes.yaxis
    axis.set_major_locator(FixedLocator(decades))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda v, _: f"10{str(round(log10(v))).translate(SUPERSCRIPTS)}"))
