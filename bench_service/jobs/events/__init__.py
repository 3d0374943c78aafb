"""The events of jobs, handed out to every listener of this process."""
