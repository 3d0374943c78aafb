"""Processes that commands are: servers, workers, supervisors, their companions, and their logs."""
