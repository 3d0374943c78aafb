"""Archives and MATLAB files with the known motion or with what a test gives them: written by zipfile and by scipy."""

import io
import zipfile
from typing import Any

import scipy.io

from bench_service.formats.logs.oxts import OXTS
from tests.formats.reading import FORCES, RATES, ROWS


def zipped(members: dict[str, str]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, text in members.items():
            archive.writestr(name, text)
    return packed.getvalue()


def kitti_drive(folder: str) -> dict[str, str]:
    """Files of the OXTS unit of a drive of KITTI, a file a sample."""
    members: dict[str, str] = {}
    for row in range(ROWS):
        motion = zip(("wx", "wy", "wz", "ax", "ay", "az"), (*RATES[row], *FORCES[row]), strict=True)
        values = dict.fromkeys(OXTS, 0.0) | dict(motion)
        members[f"{folder}data/{row:010d}.txt"] = " ".join(repr(float(v)) for v in values.values()) + "\n"
    stamps = (f"2011-09-26 13:02:{25 + r // 200:02d}.{r % 200 * 5:03d}456789\n" for r in range(ROWS))
    return {**members, f"{folder}timestamps.txt": "".join(stamps)}


def mat_file(content: dict[str, Any], **how: Any) -> bytes:
    sink = io.BytesIO()
    scipy.io.savemat(sink, content, **how)
    return sink.getvalue()
