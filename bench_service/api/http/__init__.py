"""What all routes share: dependencies, bodies, errors, request ids."""
