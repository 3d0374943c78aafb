"""Findings on raw values: missing ones, a constant channel, ends of ranges, bits, wraps."""

from procedures.analysis.fitness.bits import Bits
from procedures.analysis.fitness.edges import RAILS, Edge
from procedures.analysis.fitness.findings import Finding, FitnessSettings, Kind, Severity
from procedures.analysis.fitness.wording import Wording
from procedures.analysis.fitness.wraps import Wrap
from procedures.core.recording import AROUND, INCREMENTS, Channel


def length(name: str, seen: int, announced: int | None, settings: FitnessSettings) -> list[Finding]:
    """Return findings on a channel with too few samples, or with another number than `announced`; None: no number was
    announced.
    """
    found: list[Finding] = []
    if seen < settings.least_samples:
        told = f"channel {name}: {seen} samples are too few, at least {settings.least_samples} are needed"
        found.append(Finding(Kind.TOO_FEW, Severity.REFUSE, told, count=seen))
    if announced is not None and seen != announced:
        told = f"channel {name}: {seen} samples where {announced} are announced"
        found.append(Finding(Kind.INCOMPLETE, Severity.REFUSE, told, count=seen))
    return found


def missing(name: str, count: int, first: int, words: Wording, settings: FitnessSettings) -> list[Finding]:
    """Return the finding on samples that are no finite numbers; nothing where there are none."""
    if not count:
        return []
    severity = Severity.REFUSE if settings.gaps == "refuse" else Severity.WARN
    treated = "" if severity is Severity.REFUSE else "; they are left out as gaps"
    told = (
        f"channel {name}: {words.share(count)} {'are' if count > 1 else 'is'} not a finite number, "
        f"the first is sample {words.at(first)}{treated}"
    )
    return [Finding(Kind.NOT_FINITE, severity, told, first, count)]


def is_constant(edges: tuple[Edge, Edge], missing_count: int, seen: int) -> bool:
    """Return whether all samples that are numbers are equal."""
    top, bottom = edges
    return seen >= 2 and missing_count < seen and top.extreme == bottom.extreme


def constant(
    channel: Channel, value: float, is_integer: bool, words: Wording, settings: FitnessSettings
) -> list[Finding]:
    """Return the finding on a channel of one value, which a channel of `AROUND` may have, as a counter among other
    stations.
    """
    railed = is_integer and value in RAILS
    rail = ", the end of its range" if railed else ""
    begin = f"channel {channel.name}: the channel is constant, it reads {value:.9g}{rail}"
    told = f"{begin} throughout all {words.seen} samples; a live channel shows noise"
    counter = is_integer and channel.quantity in INCREMENTS
    if not railed and (channel.quantity in AROUND or (settings.beside_others and counter)):
        return []
    silent = (counter and settings.counters_may_rest) or settings.beside_others
    severity = Severity.WARN if silent and not railed else Severity.REFUSE
    return [Finding(Kind.CONSTANT, severity, told, 0, words.seen)]


def saturated(name: str, edges: tuple[Edge, Edge], is_integer: bool, repeats: int, words: Wording) -> list[Finding]:
    """Return findings on samples that pile up at the largest or smallest value, or at the end of a converter's range.
    `is_integer`: the channel sends whole counts.
    """
    found: list[Finding] = []
    for edge, other in (edges, edges[::-1]):
        value, count = edge.extreme, edge.count
        word = "largest" if edge.sign > 0 else "smallest"
        begin = f"channel {name}: {words.share(count)} {'stand' if count > 1 else 'stands'} at {value:.9g}, "
        end = f"; saturated, first at sample {words.at(edge.first_index)}"
        if is_integer and value in RAILS:
            severity = Severity.REFUSE if count > 1 else Severity.WARN
            found.append(
                Finding(Kind.SATURATED, severity, f"{begin}the end of its range{end}", edge.first_index, count)
            )
        elif edge.piles_up(repeats, words.seen, other):
            told = f"{begin}the {word}, and no more than {edge.near} at any of the next three values"
            found.append(Finding(Kind.SATURATED, Severity.REFUSE, f"{told}{end}", edge.first_index, count))
    return found


def coarse_bits(name: str, bits: Bits, seen: int) -> list[Finding]:
    """Return findings on stuck bits and on a resolution coarser than one count."""
    found: list[Finding] = []
    for bit, value in bits.stuck().items():
        told = (
            f"channel {name}: bit {bit} (of {1 << bit} counts) is stuck at {value}: "
            "it never changes though bits above and below it do"
        )
        found.append(Finding(Kind.STUCK_BIT, Severity.REFUSE, told, 0, seen))
    if bits.coarse():
        step, rest = 1 << bits.coarse(), bits.remainder()
        plus = f" plus {rest}" if rest else ""
        told = f"channel {name}: all values are multiples of {step}{plus}: its resolution is {step} counts"
        found.append(Finding(Kind.RESOLUTION, Severity.WARN, told, 0, seen))
    return found


def wrapped(channel: Channel, wrap: Wrap, words: Wording) -> list[Finding]:
    """Return the finding on jumps through the whole of a range."""
    bits = round(wrap.size).bit_length() - 1
    times = "once" if wrap.count == 1 else f"{wrap.count} times"
    where = f"{times}, first at sample {words.at(wrap.first_index)}"
    begin = f"channel {channel.name} jumps by {wrap.size:.0f} = 2^{bits} {where}"
    if channel.unit == "degC":
        kelvins = abs(wrap.size * channel.scale)
        begin = f"channel {channel.name} jumps by {kelvins:g} K {where}"
        told = f"{begin}: the temperature wraps in a range of so many kelvins"
    elif wrap.unsigned:
        told = f"{begin}: signed counts of {bits} bits seem to have been read as unsigned; import them again as signed"
    else:
        told = f"{begin}: counts of {bits} bits wrap at the end of their range"
    return [Finding(Kind.WRAPPED, Severity.REFUSE, told, wrap.first_index, wrap.count)]
