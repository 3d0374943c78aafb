"""Campaigns, their runs and schedules over HTTP."""
