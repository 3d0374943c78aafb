"""Values of the service: jobs, stored records, errors, requests. No logic, no I/O."""
