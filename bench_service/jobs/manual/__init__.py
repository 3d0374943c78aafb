"""Manual mode: an operator commands an idle bench by hand, within the limits and on the way to safety of jobs."""
