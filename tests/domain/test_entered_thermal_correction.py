"""Known thermal coefficients: thesis table 4.4 entered as it is printed, per code, and what is refused."""

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from procedures.core.limits import Verdict
from procedures.core.thermal_correction import TemperatureRange
from procedures.methods import discover
from procedures.procedure import Evidence

CODES = 16.0
X = {"alpha": (1.3306e-12, 1.6612e-9, -6.0141e-5, 1.6292e-8), "beta": (6.326e-5, 2.5551e-9, -4.505e-6, 1.3608e-12)}


def parameters(**more: Any) -> dict[str, Any]:
    axis = {"scale": 1.2, "bias_m_s2": -0.09, **X, "alpha_sd": [1e-9] * 4, "beta_sd": [1e-6] * 4}
    return {"origin": "thesis table 4.4", "axes": [axis] * 3, "case_codes_per_c": CODES, **more}


def test_the_table_is_entered_per_code() -> None:
    method = discover()["entered_thermal_correction"]
    result = method.analyse(Evidence(), method.params.model_validate(parameters()), None)
    assert result.verdict is Verdict.PASS
    (made,) = method.corrections(result)
    axis = made.value.axes[0]
    assert axis.alpha == pytest.approx((1.3306e-12 * CODES**2, 1.6612e-9 * CODES, -6.0141e-5, 1.6292e-8))
    assert axis.beta == pytest.approx((6.326e-5 * CODES, 2.5551e-9 * CODES**2, -4.505e-6, 1.3608e-12))
    assert axis.standard_uncertainties()[0] == pytest.approx(1e-9 * CODES**2)
    dt, v = 10.0, 9.8
    felt = axis.apply(v, 20.0 + dt, 20.0, 0.0)
    scale = 1.2 + axis.alpha[0] * dt**2 + axis.alpha[1] * dt
    assert felt == pytest.approx(scale * (v - 0.09 + axis.beta[0] * dt + axis.beta[1] * dt**2))
    assert np.shape(method.report(result).sections[0].rows) == (24, 4)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"origin": ""}, "origin"),
        ({"axes": []}, "axes"),
        ({"case_codes_per_c": 0.0}, "case_codes_per_c"),
    ],
)
def test_what_is_refused(change: dict[str, Any], field: str) -> None:
    with pytest.raises(ValidationError) as refused:
        discover()["entered_thermal_correction"].params.model_validate(parameters(**change))
    assert refused.value.errors()[0]["loc"][0] == field


def test_ranges_are_those_of_the_correction_and_are_given_both_or_not_at_all() -> None:
    method = discover()["entered_thermal_correction"]
    case, converter = (-20.0, 50.0), (-10.0, 60.0)
    both = method.params.model_validate(parameters(case_range_c=case, converter_range_c=converter))
    (made,) = method.corrections(method.analyse(Evidence(), both, None))
    assert made.value.fitted_range == TemperatureRange(case, converter)
    with pytest.raises(ValidationError, match="case_range_c and converter_range_c: both or none"):
        method.params.model_validate(parameters(case_range_c=case))
    with pytest.raises(ValidationError, match="case_range_c = 50, -20: the lower temperature first"):
        method.params.model_validate(parameters(case_range_c=case[::-1], converter_range_c=converter))


def test_coefficients_without_uncertainties_are_refused_and_zeros_fail() -> None:
    method = discover()["entered_thermal_correction"]
    bare = {k: v for k, v in parameters()["axes"][0].items() if k != "beta_sd"}
    with pytest.raises(ValidationError, match="beta_sd"):
        method.params.model_validate(parameters(axes=[bare] * 3))
    zero = {**parameters()["axes"][0], "alpha": [0.0] * 4, "beta": [0.0] * 4}
    given = method.params.model_validate(parameters(axes=[zero] * 3))
    assert method.analyse(Evidence(), given, None).verdict is Verdict.FAIL
