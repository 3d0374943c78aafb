"""Scale factors from whole turns of the table: plan, fit, summary."""
