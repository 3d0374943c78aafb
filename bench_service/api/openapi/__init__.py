"""The OpenAPI document: the framework's own, completed so that clients can be generated from it without a warning."""
