"""Jobs over HTTP: routes, schemas, event stream."""
