"""Jobs over HTTP: their routes, schemas and event stream."""
