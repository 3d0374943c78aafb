"""A coefficient's name: triad and symbol inside, the dotted text in JSON; and what a prediction is about."""

import copy
import pickle

import pytest
from pydantic import TypeAdapter, ValidationError

from procedures import catalog
from procedures.analysis.calibration.summary import Coefficient
from procedures.core.coefficient_name import CoefficientName
from procedures.procedure import Context, PredictedUncertainty

STORED = {
    "name": "gyro.b_x",
    "unit": "rad/s",
    "estimate": 1e-6,
    "standard_uncertainty": 1e-8,
    "from_noise": 1e-8,
    "from_table": 0.0,
    "from_table_source": {},
}
COEFFICIENT = TypeAdapter(Coefficient)


def test_a_stored_name_is_read_into_triad_and_symbol_and_written_back_as_it_was() -> None:
    coefficient = COEFFICIENT.validate_python(STORED)
    assert (coefficient.name.triad, coefficient.name.symbol) == ("gyro", "b_x")
    assert coefficient.name == CoefficientName("gyro", "b_x") == "gyro.b_x"
    assert COEFFICIENT.dump_python(coefficient, mode="json") == STORED
    assert COEFFICIENT.json_schema()["properties"]["name"] == {"title": "Name", "type": "string"}


@pytest.mark.parametrize("again", [copy.deepcopy, lambda name: pickle.loads(pickle.dumps(name))])
def test_a_copy_still_knows_its_parts(again) -> None:
    name = again(CoefficientName("accelerometer", "K11"))
    assert (name, name.triad, name.symbol) == ("accelerometer.K11", "accelerometer", "K11")


@pytest.mark.parametrize("text", ["b_x", ".b_x", "gyro.", ""])
def test_a_text_without_triad_or_symbol_is_refused(text: str) -> None:
    with pytest.raises(ValidationError, match=r"such as gyro\.b_x"):
        COEFFICIENT.validate_python({**STORED, "name": text})


def test_a_prediction_says_which_quantity_it_is_about_and_not_in_json() -> None:
    walk = PredictedUncertainty("gyro_x.random_walk", "rad/√s", 1e-7, 1e-7, quantity="gyro_x random walk")
    assert walk.about("gyro_x random walk")
    assert not walk.about("gyro_x.random_walk")
    assert PredictedUncertainty("gyro.b_x", "rad/s", 1.0, 1.0).about("gyro.b_x")
    assert "quantity" not in TypeAdapter(PredictedUncertainty).dump_python(walk)


def test_the_static_run_predicts_each_of_its_checks_that_rests_on_one_process(context: Context) -> None:
    procedure = catalog.discover()["static_run"]
    params = procedure.resolve(procedure.params(), context)
    names = (procedure.quantities or (lambda *_: ()))(params, context)
    about = {u.quantity for u in procedure.predict(params, context).uncertainties}
    assert {name for name in names if "bias instability" in name} <= about
