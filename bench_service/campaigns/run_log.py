"""Log lines of campaign runs: the outcome of each step and of the run, and the reasons for waiting."""

import logging

from bench_service.campaigns.run import CampaignRun, StepRun

log = logging.getLogger(__name__)


def tell(before: CampaignRun, after: CampaignRun) -> None:
    """Write a log line for each change from one state of a run to the next; a failure is a warning."""
    for old, new in zip(before.steps, after.steps, strict=True):
        _tell_step(old, new)
    if after.waiting and after.waiting != before.waiting:
        log.info("campaign run %s waits: %s", after.id, after.waiting)
    if after.state is before.state:
        return
    ended = "" if after.open else f", verdict {'none' if after.verdict is None else after.verdict.value}"
    why = f": {after.reason}" if after.reason else ""
    level = logging.WARNING if after.reason and not after.open else logging.INFO
    log.log(level, "campaign run %s of %s on %s is %s%s%s", *_names(after), after.state.value, ended, why)


def _names(run: CampaignRun) -> tuple[str, str, str]:
    return run.id, run.campaign.name, run.unit


def _tell_step(old: StepRun, new: StepRun) -> None:
    if new.attempt != old.attempt:
        log.info("step %s, attempt %d", new.name, new.attempt)
    verdict = "" if new.verdict is None else f", verdict {new.verdict.value}"
    if new.reason and new.reason != old.reason:
        log.warning("step %s is %s%s: %s", new.name, new.state.value, verdict, new.reason)
    elif new.state is not old.state:
        log.info("step %s is %s%s", new.name, new.state.value, verdict)
    for warning in new.warnings if new.warnings != old.warnings else ():
        log.warning("step %s: %s", new.name, warning)
