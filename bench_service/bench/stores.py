"""Stores that `bench` needs: the registry of benches, their live state, mountings of units, and prompts to people."""

from dataclasses import dataclass

from bench_service.bench.live.values import LiveStore
from bench_service.bench.mountings import MountingStore
from bench_service.bench.prompts import PromptStore
from bench_service.bench.registry import BenchRegistry
from bench_service.evidence.stores import EvidenceStores


@dataclass(frozen=True)
class BenchStores(EvidenceStores):
    """The stores that `bench` needs, with those of `evidence` and the packages below it, as one value."""

    benches: BenchRegistry
    live: LiveStore
    prompts: PromptStore
    mountings: MountingStore
