"""Campaigns: procedures in order with limits and stop rules, run automatically, now or at night.

`campaign` is the data, `run` one execution of it, `conductor` advances runs; `service` has the verbs for clients.
"""
