"""The events of jobs: fan-out to every listener of this process."""
