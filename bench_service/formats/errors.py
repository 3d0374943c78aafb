"""What a file that comes in can be refused for.

UnreadableFile    a file is not what its description says: names the file, the line or row, and what was expected
"""

from procedures.core.errors import DomainError


class UnreadableFile(DomainError):
    """A file is not what its description says."""

    def __init__(self, name: str, problem: str) -> None:
        super().__init__(f"{name}: {problem}")
        self.name = name
        self.problem = problem
