"""The service layer: runs procedures on a bench, stores their results, and answers over HTTP.

``__main__ > cli > app > api | pages | persistence | drivers > jobs > formats > settings | wall_clock``: the arrows are
enforced (`pyproject.toml`, import contracts). `app` is the only composition root, `api.errors` the only table from
errors to status codes, a store's method the only place that commits.
"""
