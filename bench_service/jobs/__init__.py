"""Running procedures: what a job is, who may drive a bench, and how every job ends. Knows no HTTP and no SQL."""
