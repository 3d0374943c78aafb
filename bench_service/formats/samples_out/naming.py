"""Names of exported files, which tell how their samples were treated and whether they are simulated."""

import re

from bench_service.formats.export import Extract

SIMULATED = re.compile(r"-simulated(?:[ _-]?\(?\d+\)?)?\.[A-Za-z0-9.]+$")
"""End of the name of a file of simulated samples, also of a copy of it ("-simulated (1).csv")."""


def file_stem(part: Extract, *treatment: str) -> str:
    """Return the name of a file without its ending: the recording's id, then the treatment of its samples, "part" for
    a part of them, and "simulated": CSV and NumPy's format have no other place for it.
    """
    is_part = part.start > 0 or part.stop < part.info.count or len(part.info.channels) < len(part.of_channels)
    words = [*treatment, *(["part"] if is_part else []), *(["simulated"] if part.info.simulated else [])]
    return "-".join([part.info.id, *words])
