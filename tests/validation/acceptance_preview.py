"""The campaign's preview beside the outcome of its runs: does each check scatter as it was foreseen?

A check that is an estimate of zero with the predicted standard uncertainty u has the mean square u² over runs; a root
mean square of ν degrees of freedom, such as δ/√3 or the scatter of three launches, ``expected² + u²``. Over n
independent runs the observed mean square over that is χ²/(ν·n) of ν·n degrees of freedom (ν = 1 of an estimate): the
interval. A value that is itself a claim ("3σ") is compared by its mean. Tests of significance have none.

Three departures are known. The shipped table points to 0.5″ where 1″ is declared, so the terms of whole turns come out
at half to two thirds of what is foreseen. A unit that was never calibrated is foreseen at nominal scale factors: with
an accelerometers' K of 0.82, δ comes out 1.2 times as large; and without the share of the thermal correction, as the
preview says.
"""

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.table import Table
from scipy.stats import chi2

from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.examination import Examiner
from bench_service.campaigns.power import LimitPreview
from bench_service.campaigns.run import CampaignRun
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.evidence.catalogue import Catalogue
from bench_service.jobs.planning import Planner
from procedures.procedure import Context
from tests.validation.acceptance_rig import mounted

Values = dict[tuple[str, str], float]
"""(step, check) -> value of one run."""
SHARED = ("polarity", "static", "converter", "thermal")
"""Steps that the runs of one unit share: they count once a unit."""
LEVEL = 0.05


class _Mounted(Planner):
    """Plans on the simulated bench with its unit as the runs have it, without a store."""

    def __init__(self) -> None:
        nothing: Any = None
        super().__init__(nothing, nothing, Catalogue())
        driver = SimulatedDriver("sim")
        self._known = Context(mounted(driver), driver.description)

    def context(self, unit: str, bench: str | None = None, mounting: str | None = None) -> Context:
        """The one context that there is."""
        return self._known


@dataclass(frozen=True)
class Foreseen:
    """One check over all launches of a campaign, by its preview and over the runs."""

    check: str
    unit: str
    predicted: float
    observed: float
    low: float
    """Interval of observed over predicted at 1 − `LEVEL`; 0 … ∞ for a value that is itself a claim."""
    high: float
    count: int

    @property
    def holds(self) -> bool:
        """Whether the interval has 1."""
        return self.low <= 1.0 <= self.high


def values_of(run: CampaignRun) -> Values:
    """Values of all checks of a run, by step."""
    return {(s.name, c.name): c.value for s in run.steps for c in s.checks}


def foreseen(campaign: Campaign, units: Sequence[Sequence[Values]]) -> list[Foreseen]:
    """The previews of a campaign beside its sound runs, unit by unit; launches of one kind are taken together."""
    examined = Examiner(_Mounted()).examine(campaign, "", None, strict=False)
    previews: dict[str, LimitPreview] = {}
    found: dict[str, list[float]] = defaultdict(list)
    for step in examined.steps:
        kind = re.sub(r"_\d+$", "", step.name)
        for limit in step.limits:
            name = f"{kind}: {limit.check}"
            previews.setdefault(name, limit)
            for runs in units:
                counted = runs[:1] if step.name in SHARED else runs
                found[name] += [v[step.name, limit.check] for v in counted if (step.name, limit.check) in v]
    return [made for name, one in previews.items() if found[name] and (made := _beside(name, one, found[name]))]


def _beside(name: str, one: LimitPreview, values: Sequence[float]) -> Foreseen | None:
    """One check's preview beside its values; None for a test of significance, and where nothing is foreseen."""
    known, n = np.array(values), len(values)
    if one.unit == "1" and one.level is not None and one.standard_uncertainty is None:
        return None
    if one.standard_uncertainty is None:
        if one.expected is None:
            return None
        mean = float(known.mean())
        return Foreseen(name, one.unit, one.expected, mean, 0.0, float("inf"), n)
    predicted = float(np.hypot(one.expected or 0.0, one.standard_uncertainty))
    if predicted == 0.0:
        return None
    observed = float(np.sqrt(np.mean(known**2)))
    freedom = n * (one.degrees_of_freedom or 1.0)
    ratio = observed / predicted
    low, high = (ratio * float(np.sqrt(freedom / f(LEVEL / 2, freedom))) for f in (chi2.isf, chi2.ppf))
    return Foreseen(name, one.unit, predicted, observed, low, high, n)


def table_of(rows: Sequence[Foreseen]) -> Table:
    """A row a check: what was foreseen, what came, and their ratio."""
    table = Table("check", "unit", "foreseen", "observed", "ratio", "95 % interval", "values", "")
    for r in rows:
        interval = f"{r.low:.3f} … {r.high:.3f}" if np.isfinite(r.high) else "–"
        ratio = f"{r.observed / r.predicted:.3f}"
        told = (r.check, r.unit, f"{r.predicted:.4g}", f"{r.observed:.4g}", ratio, interval, str(r.count))
        table.add_row(*told, "" if r.holds else "apart")
    return table
