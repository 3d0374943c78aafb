"""Imports of a chunk's way to Parquet and back: pandas, where it is installed, would be brought in by Arrow."""

import subprocess
import sys

ROUND_TRIP = """
import sys
import numpy as np
from bench_service.formats.chunk import ChunkPlace, decode_chunk, encode_chunk
for dtype in (np.int32, np.float64):
    samples = np.arange(12).reshape(6, 2).astype(dtype)
    payload = encode_chunk(samples, ("x", "y"), ChunkPlace("r", 0, 400.0))
    assert np.array_equal(decode_chunk(payload, ("y", "x")), samples[:, ::-1])
    assert decode_chunk(encode_chunk(samples[:0], ("x",), ChunkPlace("r", 0, 1.0)), ("x",)).dtype == dtype
print("pyarrow" in sys.modules, "pandas" in sys.modules)
"""


def test_a_chunk_is_written_and_read_without_pandas() -> None:
    done = subprocess.run([sys.executable, "-c", ROUND_TRIP], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "False"]
