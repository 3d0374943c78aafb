"""Exceptions for files that are refused at import.

UnreadableFile    a file does not match its description: names the file, the line or row, and what was expected
"""

from procedures.core.errors import DomainError


class UnreadableFile(DomainError):
    """Raised for a file that does not match its description; names the file, the line or row, and what was expected."""

    def __init__(self, name: str, problem: str) -> None:
        super().__init__(f"{name}: {problem}")
        self.name = name
        self.problem = problem
