"""HTTP in, HTTP out, ``/api/v1``: one file per noun, no rules of its own."""
