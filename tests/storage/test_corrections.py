"""Correction sets: they come in with a result, one of a kind is current, a person may choose, lineage both ways."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import timedelta

import pytest

from bench_service import wall_clock
from bench_service.campaigns.stores import Stores
from bench_service.evidence.corrections import StoredCorrection
from bench_service.model.calibrations import Act, Approval, Decider
from bench_service.model.errors import CorrectionRefused, IdempotencyConflict, NotFound
from bench_service.model.job import Job, JobState
from bench_service.model.records import Idempotency, StoredResult
from procedures.core.errors import BadParameter
from procedures.core.limits import Verdict
from procedures.core.thermal_correction import Form
from procedures.core.unit import Unit
from procedures.core.unit_correction import UnitCorrection
from tests.correction_samples import converter, gyros, thermal, thermometers
from tests.storage.conftest import CHANNELS

NewResult = Callable[..., StoredResult]
ANN = Decider("Ann", "the newer one was made cold")


def test_a_correction_comes_back_to_the_last_bit(stores: Stores, new_result: NewResult) -> None:
    given = [thermal(1, Form.SWITCHED), converter(2)]
    result = stores.results.add(new_result(), corrections=given)
    newest = stores.corrections.list("U-1").items
    assert sorted(c.correction.kind for c in newest) == ["converter", "thermal"]
    assert {repr(c.correction) for c in newest} == {repr(g) for g in given}
    assert {(c.result_id, c.current, c.simulated, c.made_at) for c in newest} == {
        (result.id, True, True, result.created_at)
    }
    for correction in newest:
        assert stores.corrections.get("U-1", correction.id) == correction
        with pytest.raises(NotFound, match="unit U-2 has none"):
            stores.corrections.get("U-2", correction.id)


def test_of_each_kind_one_is_current(stores: Stores, new_result: NewResult) -> None:
    assert stores.corrections.current("U-1", "thermal") is None
    for seed in (1, 2):
        stores.results.add(new_result(), corrections=[thermal(seed)])
    stores.results.add(new_result(unit="U-2"), corrections=[thermal(3)])
    stores.results.add(new_result(), corrections=[converter(4)])
    stores.results.add(new_result(), by_rule=False, corrections=[thermal(5), converter(6)])
    shown = [c for c in stores.corrections.list("U-1").items if c.current]
    assert {repr(c.correction) for c in shown} == {repr(thermal(2)), repr(converter(4))}
    page = stores.corrections.list("U-1", kind="thermal", limit=2)
    rest = stores.corrections.list("U-1", kind="thermal", after=page.next)
    assert [repr(c.correction) for c in (*page.items, *rest.items)] == [repr(thermal(s)) for s in (5, 2, 1)]
    assert rest.next is None
    assert stores.corrections.current("U-1", "converter") in shown


@pytest.mark.parametrize("verdict", [Verdict.FAIL, Verdict.ERROR])
def test_one_of_a_result_that_did_not_pass_is_chosen_with_a_remark(
    stores: Stores, new_result: NewResult, verdict: Verdict
) -> None:
    stores.results.add(new_result(), corrections=[thermal(1)])
    stores.results.add(new_result(verdict=verdict), by_rule=False, corrections=[thermal(2)])
    failed, good = stores.corrections.list("U-1", kind="thermal").items
    key = Idempotency("k", "f")
    with pytest.raises(CorrectionRefused, match=rf"{failed.id}.*verdict is {verdict}.*remark"):
        stores.corrections.make_current("U-1", failed.id, Decider("Bo"), key)
    assert stores.corrections.current("U-1", "thermal") == good
    assert stores.corrections.make_current("U-1", failed.id, ANN, key).current
    assert stores.corrections.make_current("U-1", good.id, Decider("Bo")).current


@pytest.mark.parametrize("verdict", [Verdict.FAIL, Verdict.ERROR])
def test_one_of_a_job_that_did_not_pass_never_becomes_current_by_itself(
    stores: Stores, new_result: NewResult, verdict: Verdict
) -> None:
    stores.units.put_unit(Unit("U-1", 100.0, CHANNELS))
    alone = stores.results.add(new_result(verdict=verdict), corrections=[thermal(1), thermometers(1)])
    assert not any(c.current for c in stores.corrections.list("U-1").items)
    assert stores.units.unit("U-1").thermal_correction is None
    stores.results.add(new_result(), corrections=[thermal(2)])
    stores.results.add(new_result(verdict=verdict), corrections=[thermal(3)])
    failed, good, first = stores.corrections.list("U-1", kind="thermal").items
    assert [c.current for c in (failed, good, first)] == [False, True, False], "a failed one takes nobody's place"
    assert (first.result_id, first.verdict, good.verdict) == (alone.id, verdict, Verdict.PASS)
    assert good.why_not_current == ""
    assert f"result {alone.id}, whose verdict is {verdict}" in first.why_not_current
    chosen = stores.corrections.make_current("U-1", failed.id, ANN)
    assert (chosen.current, chosen.why_not_current) == (True, "")
    stores.results.add(new_result(), by_rule=False, corrections=[thermal(4)])
    analysed = stores.corrections.list("U-1", kind="thermal").items[0]
    assert "second analysis or a method" in analysed.why_not_current
    stores.corrections.make_current("U-1", good.id, ANN)
    assert "another one has taken its place" in stores.corrections.get("U-1", failed.id).why_not_current


def test_a_person_chooses_which_one_is_current(stores: Stores, new_result: NewResult) -> None:
    for seed in (1, 2):
        stores.results.add(new_result(), corrections=[thermal(seed), converter(seed)])
    new, old = stores.corrections.list("U-1", kind="thermal").items
    models = stores.corrections.current("U-1", "converter")
    key = Idempotency("k", "f")
    chosen = stores.corrections.make_current("U-1", old.id, ANN, key)
    assert chosen == replace(old, current=True, decisions=chosen.decisions)
    assert stores.corrections.list("U-1", kind="thermal").items == (replace(new, current=False), chosen)
    assert stores.corrections.current("U-1", "converter") == models, "the other kind is left alone"
    assert [(d.act, d.by, d.remark) for d in chosen.decisions] == [(Act.CHOSEN, ANN.by, ANN.remark)]
    chosen_again = stores.corrections.make_current("U-1", new.id, ANN)
    assert chosen_again.current
    again = stores.corrections.make_current("U-1", old.id, ANN, key)
    assert not again.current, "a repeated request does not undo what was chosen since"
    with pytest.raises(IdempotencyConflict):
        stores.corrections.make_current("U-1", old.id, ANN, Idempotency("k", "g"))
    with pytest.raises(NotFound):
        stores.corrections.make_current("U-2", old.id, ANN)
    assert (
        stores.corrections.current("U-1", "thermal") == chosen_again == replace(new, decisions=chosen_again.decisions)
    )


def test_a_persons_choice_stands_until_it_is_given_back_rejected_or_expires(
    stores: Stores, new_result: NewResult, new_job: Callable[..., Job]
) -> None:
    def passed(seed: int) -> StoredCorrection:
        """The correction of a job that passed, as its own result."""
        job = stores.jobs.add(new_job(state=JobState.RUNNING))
        result = stores.results.add(new_result(job_id=job.id), corrections=[thermal(seed)])
        stores.jobs.transition(
            job.id, JobState.SUCCEEDED, at=wall_clock.now(), verdict=result.verdict, result_id=result.id
        )
        return next(c for c in stores.corrections.list("U-1").items if c.result_id == result.id)

    with pytest.raises(CorrectionRefused, match="no job that passed has given unit U-1 a usable correction"):
        stores.corrections.choose_by_rule("U-1", "thermal", ANN)
    old = passed(1)
    assert (old.current, old.by_rule, old.of_job) == (True, True, True)
    chosen = stores.corrections.make_current("U-1", old.id, ANN)
    assert (chosen.current, chosen.by_rule) == (True, False)
    newer = passed(2)
    assert not newer.current, "Ann's choice stands"
    assert "one that a person chose stands" in newer.why_not_current
    back = stores.corrections.choose_by_rule("U-1", "thermal", Decider("Bo", "the new cycle is better"))
    assert (back.id, back.current, back.by_rule) == (newer.id, True, True)
    assert [(d.act, d.by) for d in back.decisions] == [(Act.GIVEN_BACK, "Bo")]
    assert passed(3).current, "the rule takes the newest again"
    stores.corrections.make_current("U-1", old.id, ANN)
    stores.corrections.reject("U-1", old.id, ANN)
    assert passed(4).current, "a rejected one does not stand"


def test_of_many_choices_at_once_one_stands(stores: Stores, new_result: NewResult) -> None:
    for seed in range(4):
        stores.results.add(new_result(), corrections=[thermal(seed)])
    ids = [c.id for c in stores.corrections.list("U-1").items]
    with ThreadPoolExecutor(4) as workers:
        list(workers.map(lambda i: stores.corrections.make_current("U-1", ids[i % 4], ANN), range(12)))
        list(workers.map(lambda i: stores.results.add(new_result(), corrections=[thermal(i)]), range(4)))
    history = stores.corrections.list("U-1").items
    assert len(history) == 8
    assert sum(c.current for c in history) == 1


def test_lineage_is_read_both_ways(stores: Stores, new_result: NewResult) -> None:
    stores.results.add(new_result(), corrections=[thermal(1), converter(2)])
    ids = tuple(c.id for c in stores.corrections.list("U-1").items)
    first = stores.results.add(new_result(corrections=ids))
    second = stores.results.add(new_result(corrections=ids[:1]))
    assert stores.results.get(first.id).corrections == ids
    assert [r.corrections for r in stores.results.list().items] == [ids[:1], ids, ()]
    assert stores.corrections.used_by(ids[0]) == (second.id, first.id)
    assert stores.corrections.used_by(ids[1]) == (first.id,)
    assert stores.corrections.used_by("nobody") == ()


def test_a_result_that_cannot_be_stored_leaves_no_correction(stores: Stores, new_result: NewResult) -> None:
    with pytest.raises(NotFound, match="correction 'c'"):
        stores.results.add(new_result(corrections=("c",)), corrections=[thermal(1)])
    with pytest.raises(ValueError, match="unit"):
        stores.results.add(new_result(unit=None), corrections=[thermal(1)])
    with pytest.raises(ValueError, match="at most one"):
        stores.results.add(new_result(), corrections=[thermal(1), thermal(2)])
    assert stores.results.list().items == ()
    assert stores.corrections.list("U-1").items == ()


def test_a_key_makes_one_correction(stores: Stores, new_result: NewResult) -> None:
    for _ in range(2):
        stores.results.add(new_result(), idempotency=Idempotency("k", "f"), corrections=[thermal(1)])
    assert len(stores.corrections.list("U-1").items) == 1


def test_a_unit_comes_back_with_its_current_corrections(stores: Stores, new_result: NewResult) -> None:
    unit = Unit("U-1", 400.0, CHANNELS)
    stores.units.put_unit(unit)
    stores.units.put_unit(replace(unit, serial="U-2"))
    stores.results.add(new_result(), corrections=[thermal(1), converter(2)])
    stores.results.add(new_result(), corrections=[thermal(3)])
    newest = stores.corrections.list("U-1").items
    current = {c.correction.kind: c for c in newest if c.current}
    known = stores.units.unit("U-1")
    assert known == replace(
        unit,
        thermal_correction=thermal(3).thermal,
        thermal_correction_id=current["thermal"].id,
        converter=converter(2).converter,
        converter_id=current["converter"].id,
    )
    stores.units.put_unit(known)
    assert stores.units.units() == (known, replace(unit, serial="U-2")), "they are not a part of the unit's document"


def test_a_correction_says_what_it_is() -> None:
    with pytest.raises(BadParameter, match="kind"):
        UnitCorrection("converter", thermal(1).value)


def test_people_approve_reject_and_end_a_correction(stores: Stores, new_result: NewResult) -> None:
    """A rejected or expired one is withheld from the unit, with the way out; an approval gives it back."""
    stores.units.put_unit(Unit("U-1", 100.0, CHANNELS))
    stores.results.add(new_result(), corrections=[thermal(1), thermometers(2), gyros(3)])
    unit = stores.units.unit("U-1")
    assert unit.thermometers == thermometers(2).thermometers
    assert unit.gyro_correction == gyros(3).gyros
    assert len(unit.correction_ids(["gyros"])) == 1
    known = stores.corrections.current("U-1", "thermometers")
    assert known is not None
    key = Idempotency("k", "f")
    rejected = stores.corrections.reject("U-1", known.id, Decider("Ann", "the chamber's door stood open"), key)
    assert stores.corrections.reject("U-1", known.id, Decider("Ann", "again"), key) == rejected
    assert (rejected.approval, rejected.current, len(rejected.decisions)) == (Approval.REJECTED, True, 1)
    unit = stores.units.unit("U-1")
    assert unit.thermometers is None
    assert unit.thermometers_id is None
    assert "was rejected by Ann: the chamber's door stood open" in unit.why_withheld("thermometers")
    assert unit.thermal_correction is not None
    past = wall_clock.now() - timedelta(days=1)
    expired = stores.corrections.approve("U-1", known.id, Decider("Bo"), past)
    assert [d.act for d in expired.decisions] == [Act.REJECTED, Act.APPROVED]
    assert "expired" in stores.units.unit("U-1").why_withheld("thermometers")
    stores.corrections.approve("U-1", known.id, Decider("Bo"), past + timedelta(days=30))
    (back,) = stores.units.units()
    assert back.thermometers == thermometers(2).thermometers
    with pytest.raises(NotFound, match="unit U-2 has none"):
        stores.corrections.reject("U-2", known.id, Decider("Ann", "no"))
