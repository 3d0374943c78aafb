"""Proposed descriptions of files: what can be read off, what was guessed and why, what a person has to decide.

`propose` is the way in. Nothing here is used without a person's word: an import takes a description, not a proposal.
"""
