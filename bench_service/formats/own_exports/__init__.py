"""Exports of this service that come back: what they say of themselves, and the description and marks that follow."""
