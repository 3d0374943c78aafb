"""A `Figure` of the domain as an SVG, drawn by matplotlib. Imported beside the first answers, not before."""

from functools import lru_cache
from io import StringIO

from procedures.core.report import Figure, Series

SIZE_IN = (7.2, 3.4)
COLOURS = ("#1f5fa8", "#c2410c", "#15803d", "#7c3aed", "#a16207", "#0e7490")
MARKS = ("o", "^", "s", "D", "v", "P")


def warm_up() -> None:
    """Load matplotlib, so that nobody waits for it at the first plot."""
    svg(Figure("", "", "", (Series("", (0.0, 1.0), (0.0, 1.0)),)))


@lru_cache(maxsize=200)
def svg(figure: Figure) -> str:
    """The figure as an inline `<svg>` element; drawn once, because a result never changes."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure as Canvas

    with rc_context({"svg.fonttype": "none", "font.size": 9, "axes.formatter.useoffset": False}):
        canvas = Canvas(figsize=SIZE_IN, layout="constrained")
        FigureCanvasSVG(canvas)
        axes = canvas.add_subplot()
        for index, series in enumerate(figure.series):
            _draw(axes, series, COLOURS[index % len(COLOURS)], MARKS[index % len(MARKS)])
        axes.set_xlabel(figure.x_label)
        axes.set_ylabel(figure.y_label)
        if figure.x_log:
            axes.set_xscale("log")
        if figure.y_log:
            axes.set_yscale("log")
        axes.grid(visible=True, which="both", linewidth=0.4, alpha=0.5)
        if len(figure.series) > 1:
            axes.legend(fontsize=8, framealpha=0.8)
        out = StringIO()
        canvas.savefig(out, format="svg", metadata={"Date": None})
    text = out.getvalue()
    return text[text.index("<svg") :]


def _draw(axes: "object", series: Series, colour: str, mark: str) -> None:
    """One series in its style; error bars where it has them."""
    from matplotlib.axes import Axes

    assert isinstance(axes, Axes)
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
