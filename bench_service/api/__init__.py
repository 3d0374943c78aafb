"""HTTP interface of the service under ``/api/v1``: one file for each resource, without rules of its own."""
