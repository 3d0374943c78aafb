"""Reader of `/metrics`: its numbers by name and labels."""

import httpx
from prometheus_client.parser import text_string_to_metric_families


def scraped(http: httpx.Client) -> dict[tuple[str, ...], float]:
    """(name, label values in the order of their names) -> value."""
    answer = http.get("/metrics")
    assert answer.status_code == 200, answer.text
    return {
        (sample.name, *(sample.labels[name] for name in sorted(sample.labels))): sample.value
        for family in text_string_to_metric_families(answer.text)
        for sample in family.samples
    }
