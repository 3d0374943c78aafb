"""One bench and its safety: the driver of its devices, the session of a job on them, watchdog and supervisor."""
