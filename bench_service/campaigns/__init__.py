"""Campaigns: procedures in order with limits and stop rules, done by themselves, now or at night.

`campaign` is the data, `run` one execution of it, `conductor` what moves runs on; `service` is what clients may ask.
"""
