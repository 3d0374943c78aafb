"""Batches of analyses: submission, the interface of their store, and the runner that claims tasks; no bench is
needed.
"""
