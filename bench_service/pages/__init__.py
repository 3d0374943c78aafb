"""HTML pages of the service: plain HTML with plots, made from the same results that the API gives."""
