"""Pages for an eye: plain HTML with plots, made from the same results that the API gives."""
