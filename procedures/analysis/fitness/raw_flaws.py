"""Findings on raw values: missing ones, a constant channel, ends of ranges, bits, wraps."""

from collections.abc import Sequence
from math import gcd

from procedures.analysis.fitness.bits import Bits
from procedures.analysis.fitness.edges import RAILS, Edge
from procedures.analysis.fitness.findings import Finding, FitnessSettings, Kind, Severity
from procedures.analysis.fitness.wording import Wording, amount, gain_of
from procedures.analysis.fitness.wraps import Wrap
from procedures.core.recording import AROUND, INCREMENTS, Channel

MOST_CHANGES, SAMPLES_OF_CHANGE = 5, 200
"""Most changes of a channel that gives no signal, and fewest samples for each of them: fewer samples of a coarse
channel may well be as quiet."""
SAME_RATIO = 1e-5
"""Departure of the ratio of two channels from ±1 below which it counts as ±1."""
WITHOUT_GAPS = (
    "; ways out: a stretch without them (start_s and stop_s), or an Allan deviation that leaves gaps out (gaps)"
)
"""Ways out for a channel with some missing values."""
LEAST_LEVELS = 24
"""Fewest outermost levels whose counts show a repetition: by chance all are even once in 2^24."""
GREATEST_VALUE, LEAST_SPREAD = 1e18, 1e-24
"""Bounds of values and of their variation [SI], far from those of any sensor."""


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
    treated = "; they are left out as gaps"
    if severity is Severity.REFUSE:
        treated = WITHOUT_GAPS if count < words.seen else "; leave the channel out (channels), or import it anew"
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


def impossible_values(channel: Channel, low: float, high: float, words: Wording) -> list[Finding]:
    """Return the finding on values too large, or too little varied, for a sensor in any unit: squares of them overflow
    or vanish. `low`, `high`: least and greatest value [raw].
    """
    size = abs(gain_of(channel, words.rate_hz))
    most, spread = max(abs(low), abs(high)) * size, (high * 0.5 - low * 0.5) * size * 2.0
    if most <= GREATEST_VALUE and spread >= LEAST_SPREAD:
        return []
    value = f"reads up to {most:.3g}" if most > GREATEST_VALUE else f"varies by {spread:.3g}"
    told = (
        f"channel {channel.name} {value} {channel.rate_unit} where {LEAST_SPREAD:g} … {GREATEST_VALUE:g} is the widest "
        "range of any sensor: its unit or its scale is wrong; import it anew with the right one"
    )
    return [Finding(Kind.WRONG_UNIT, Severity.REFUSE, told, 0, words.seen)]


def repeats_itself(edges: Sequence[tuple[Edge, Edge]], words: Wording, settings: FitnessSettings) -> list[Finding]:
    """Return the finding on a recording that consists of the same part several times: the number of samples at each of
    its outermost levels then is a multiple of the number of parts. `edges`: of the channels of sensors.
    """
    counts = [count for pair in edges for edge in pair for count in edge.levels.values()]
    times = gcd(*counts) if len(counts) >= LEAST_LEVELS else 1
    if times < 2:
        return []
    one_s = words.seen / words.rate_hz / times
    told = (
        f"the recording seems to hold itself {times} times: every largest and smallest value of all channels occurs "
        f"{times} times or a multiple of it; was a file joined with itself? One part is {one_s:.6g} s long (stop_s)"
    )
    severity = Severity.WARN if settings.means_only else Severity.REFUSE
    return [Finding(Kind.REPEATED, severity, told, 0, words.seen, of_row=True)]


def is_dead(channel: Channel, changes: int, seen: int, is_integer: bool, settings: FitnessSettings) -> bool:
    """Return whether a channel changes so rarely that it gives no signal between: not a counter, nor a short dwell."""
    rests = channel.quantity in AROUND or (is_integer and channel.quantity in INCREMENTS) or settings.beside_others
    return not rests and 0 < changes <= MOST_CHANGES and seen >= SAMPLES_OF_CHANGE * changes


def dead(
    channel: Channel, values: tuple[float, float], changes: int, first_index: int, words: Wording
) -> list[Finding]:
    """Return the finding on a channel that stands still but for a few changes; `values`: its least and greatest."""
    times = "one change" if changes == 1 else f"{changes} changes"
    told = (
        f"channel {channel.name}: the channel stands still but for {times} within {values[0]:.9g} … {values[1]:.9g}, "
        f"the first at sample {words.at(first_index)}, in all {words.seen} samples; a live channel shows noise"
    )
    return [Finding(Kind.CONSTANT, Severity.REFUSE, told, first_index, words.seen)]


def twin(channel: Channel, of: Channel, ratio: float, words: Wording) -> Finding:
    """Return the finding on a channel that repeats another one; `ratio` of their changes in raw units."""
    if channel.rate_unit == of.rate_unit:
        ratio *= gain_of(channel, words.rate_hz) / gain_of(of, words.rate_hz)
    factor = "" if abs(ratio - 1.0) < SAME_RATIO else " negated" if abs(ratio + 1.0) < SAME_RATIO else f" × {ratio:.6g}"
    told = (
        f"channel {channel.name} repeats channel {of.name}{factor} sample by sample: two sensors never agree so, one "
        "of the two columns holds the other's values"
    )
    return Finding(Kind.TWIN, Severity.WARN, told, 0, words.seen)


def grows_evenly(channel: Channel, step: float, words: Wording) -> Finding:
    """Return the finding on a channel that changes by the same amount, `step` raw, from sample to sample."""
    grows = "grows" if step > 0.0 else "falls"
    told = (
        f"channel {channel.name} {grows} by {amount(channel, words.rate_hz, abs(step))} from each sample to the next: "
        "a counter or a clock does so, a sensor at rest shows noise; is this the right column?"
    )
    return Finding(Kind.EVEN_STEPS, Severity.REFUSE, told, 0, words.seen)


def saturated(name: str, edges: tuple[Edge, Edge], is_integer: bool, repeats: int, words: Wording) -> list[Finding]:
    """Return findings on samples that pile up at the largest or smallest value, or at the end of a converter's range.
    `is_integer`: the channel sends whole counts.
    """
    found: list[Finding] = []
    for edge, other in (edges, edges[::-1]):
        value, count = edge.extreme, edge.count
        word = "largest" if edge.sign > 0 else "smallest"
        begin = f"channel {name}: {words.share(count)} {'stand' if count > 1 else 'stands'} at {value:.9g}, "
        first = f", first at sample {words.at(edge.first_index)}"
        if is_integer and value in RAILS:
            severity = Severity.REFUSE if count > 1 else Severity.WARN
            found.append(
                Finding(
                    Kind.SATURATED, severity, f"{begin}the end of its range; saturated{first}", edge.first_index, count
                )
            )
        elif edge.piles_up(repeats, words.seen, other):
            told = f"{begin}the {word}, and no more than {edge.near} at any of the next three values"
            lost = value == 0.0 and edge.is_far
            zeros = "; zeros seem to stand for lost samples, which NaN marks; or saturated" if lost else "; saturated"
            found.append(Finding(Kind.SATURATED, Severity.REFUSE, f"{told}{zeros}{first}", edge.first_index, count))
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
