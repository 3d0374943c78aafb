"""Campaigns that come with the service. They cannot be changed, only copied."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

from bench_service.campaigns.campaign import Campaign

FOLDER = Path(__file__).parent


@cache
def shipped() -> Mapping[str, Campaign]:
    """Return the campaigns that come with the service, by name."""
    found = (Campaign.model_validate_json(file.read_bytes()) for file in sorted(FOLDER.glob("*.json")))
    return {campaign.name: campaign for campaign in found}
