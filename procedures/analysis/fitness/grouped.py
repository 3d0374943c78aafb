"""Findings of one recording or of many stations, merged into as few sentences as possible."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from procedures.analysis.fitness.findings import ChannelFitness, Finding, Kind, Severity

NAMED = 12
"""Most stations that a sentence names; of further ones it gives the number."""


@dataclass
class _Group:
    """One kind of flaw of one channel, or of several channels that share it."""

    sentence: str
    label: str
    others: list[str] = field(default_factory=list[str])


def grouped(
    found: Sequence[tuple[str, Sequence[ChannelFitness]]], severity: Severity, but: Kind | None = None
) -> tuple[str, ...]:
    """Sentences about recordings, (label, findings) each; `but` for one kind.

    For a single recording, each different sentence once. For several, each kind of flaw of a channel once, with the
    station where it appears first and the names of the others.
    """
    groups: dict[tuple[Kind, str], _Group] = {}
    for label, fitness in found:
        for sentence, finding, names in _together(fitness, severity):
            if finding.kind is but:
                continue
            key = (finding.kind, sentence if len(found) == 1 else "" if finding.of_row else ", ".join(names))
            if key not in groups:
                groups[key] = _Group(sentence, label)
            elif groups[key].label != label and label not in groups[key].others:
                groups[key].others.append(label)
    return tuple(group.sentence if len(found) == 1 else _of_stations(group, len(found)) for group in groups.values())


def _together(fitness: Iterable[ChannelFitness], severity: Severity) -> Iterable[tuple[str, Finding, tuple[str, ...]]]:
    """Each sentence with its channels; equal sentences are merged into one for all their channels."""
    alike: dict[tuple[Kind, str], tuple[Finding, list[str]]] = {}
    for channel in fitness:
        begin = f"channel {channel.channel}: "
        for finding in channel.findings:
            if finding.severity is severity:
                key = (finding.kind, finding.sentence.removeprefix(begin))
                alike.setdefault(key, (finding, []))[1].append(channel.channel)
    for (_, rest), (finding, names) in alike.items():
        own = finding.sentence != rest
        yield (
            (f"channels {', '.join(names)}: {rest}" if own and len(names) > 1 else finding.sentence),
            finding,
            (*names,),
        )


def _of_stations(group: _Group, stations: int) -> str:
    begin = f"{group.label}: {group.sentence}"
    others = group.others
    if not others:
        return begin
    if len(others) == stations - 1:
        return f"{begin}; the same kind of flaw in all {stations} recordings"
    if len(others) > NAMED:
        return (
            f"{begin}; the same kind of flaw in {len(others)} other recordings, among them {', '.join(others[:NAMED])}"
        )
    return f"{begin}; the same kind of flaw in {', '.join(others)}"
