"""Requests of commands: the client of a service, retries, and watching what a service does."""
