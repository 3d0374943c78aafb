"""Faults are found and named, sound recordings are left alone: 20 inputs a kind of fault, 40 a kind of sound ones.

Required: at least 95 % of each; with 20 inputs of a kind 19 or 20, of the sound ones together 95 %.
"""

import sys
from collections import Counter

import numpy as np

from procedures.analysis.fitness.findings import ChannelFitness, Finding, FitnessSettings
from procedures.analysis.fitness.stream import inspect
from procedures.core.recording import ACCELEROMETER, GYRO, Channel, MemoryRecording, Quantity, RecordingInfo
from tests.validation.inspection_faults import FAULTS, Fault
from tests.validation.inspection_records import SOUND, Array, Record

EACH, SOUND_EACH, SEED, WANTED = 20, 40, 20260, 0.95


def channels(record: Record, temperature: bool = False) -> tuple[Channel, ...]:
    """The product's words for the channels of a record."""
    gyro, force = Quantity.ANGULAR_RATE, Quantity.SPECIFIC_FORCE
    units = ("count", "count") if record.scale is None else ("rad/s", "m/s^2")
    if record.increments:
        gyro, force = Quantity.ANGLE_INCREMENT, Quantity.VELOCITY_INCREMENT
        units = ("count", "count") if record.scale is None else ("rad", "m/s")
    scale = record.scale or (1.0, 1.0)
    found = [Channel(n, gyro, units[0], scale[0]) for n in GYRO]
    found += [Channel(n, force, units[1], scale[1]) for n in ACCELEROMETER]
    return (*found, Channel("board", Quantity.TEMPERATURE, "degC")) if temperature else tuple(found)


def inspected(record: Record, temperature: Array | None = None) -> dict[int, list[Finding]]:
    """Findings by column."""
    samples = record.samples
    if temperature is not None:
        samples = np.column_stack([samples.astype(np.float64), temperature])
    described = channels(record, temperature is not None)
    info = RecordingInfo("r", "U", described, record.rate_hz, len(samples))
    settings = FitnessSettings(at_rest=record.still, counters_may_rest=True, beside_others=True)
    found: tuple[ChannelFitness, ...] = inspect(MemoryRecording(info, samples), settings)
    return {c: list(f.findings) for c, f in enumerate(found) if f.findings}


def missed(fault: Fault) -> str:
    """Why a fault is not found as it should be; empty where it is."""
    found = inspected(fault.record, fault.temperature)
    for c in fault.columns:
        of_kind = [f for f in found.get(c, []) if f.kind.value == fault.kind]
        if not of_kind:
            return f"column {c}: no {fault.kind}, but {[f.kind.value for f in found.get(c, [])]}"
        why = [_wrong(fault, f) for f in of_kind]
        if all(why):
            return f"column {c}: {why[0]}: {of_kind[0].sentence}"
    others = {c: f for c, f in found.items() if c not in fault.columns and any(not g.of_row for g in f)}
    return f"also {[f[0].sentence for f in others.values()]}" if others else ""


def _wrong(fault: Fault, f: Finding) -> str:
    if fault.index is not None and abs((f.first_index or 0) - fault.index) > fault.within:
        return f"sample {f.first_index} for {fault.index}"
    if fault.count is not None and f.count != fault.count:
        return f"{f.count} for {fault.count}"
    for word in fault.says:
        if word.startswith("longest "):
            told = int(f.sentence.split("the longest ")[1].split()[0])
            if abs(told - int(word.split()[1])) > 2:  # a repeat by chance may stand beside a run
                return f"{told} for {word}"
        elif word.startswith("rate "):
            told = float(f.sentence.split("at about ")[1].split()[0])
            if abs(told / float(word.split()[1]) - 1.0) > 0.05:
                return f"{told} for {word}"
        elif word.startswith("height "):
            raw = float(f.sentence.split("by ")[1].split()[0])
            if abs(raw / float(word.split()[1]) - 1.0) > 0.3:
                return f"height {raw} for {word}"
        elif word.startswith("factor "):
            told = float(f.sentence.split("to ")[1].split()[0])
            if abs(np.log(told / float(word.split()[1]))) > 0.25:
                return f"{told} for {word}"
        elif word not in f.sentence:
            return f"{word!r} is not said"
    return ""


def named(record: Record) -> str:
    """Findings about a sound recording; a coarse resolution is true and no fault."""
    return "; ".join(f.sentence for fs in inspected(record).values() for f in fs if f.kind.value != "resolution")


def main(each: int = EACH, sound_each: int = SOUND_EACH, verbose: bool = False, seed: int = SEED) -> bool:
    """Print both tables; whether all of it is as required."""
    good, quiet, total = True, 0, 0
    for i, (name, make) in enumerate(FAULTS.items()):
        whys = [missed(make(np.random.default_rng((seed, i, j)))) for j in range(each)]
        hits = sum(not why for why in whys)
        good = good and hits >= WANTED * each
        print(f"{name:34} found as it is in {hits:3} of {each}")
        for why in filter(None, whys if verbose else ()):
            print("      ", why[:300])
    for i, (name, make) in enumerate(SOUND.items()):
        told = [named(make(np.random.default_rng((seed + 1, i, j)))) for j in range(sound_each)]
        quiet, total = quiet + sum(not t for t in told), total + sound_each
        print(f"{'sound: ' + name:34} nothing named in {sum(not t for t in told):3} of {sound_each}")
        for text, times in Counter(filter(None, told)).items() if verbose else ():
            print("      ", times, text[:300])
    print(f"sound recordings of which nothing is named: {quiet} of {total}")
    return good and quiet >= WANTED * total


if __name__ == "__main__":
    sys.exit(0 if main(verbose="-v" in sys.argv, seed=int(sys.argv[-1]) if sys.argv[-1].isdigit() else SEED) else 1)
