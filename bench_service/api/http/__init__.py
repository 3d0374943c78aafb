"""Code that all routes share: dependencies, bodies, errors, request ids."""
