"""Random and mutated files for the readers of imports, each with a description; the same seed, the same file."""

import gzip
import io
import zlib
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

ROWS = 300
EXTREMES = (
    b"nan",
    b"-inf",
    b"1e308",
    b"-1e308",
    b"9" * 400,
    b"1e-400",
    b"0x10",
    b"1,5",
    b"",
    b" ",
    b"2147483648",
    b"12:34:56.7",
    b"-9223372036854775808",
    b"9223372036854775807",
    b"2026-02-30 25:61:61",
    b"\x00",
    b'"',
    b'""',
    b"\xff\xfe",
    b"+",
    b"1_0",
    b"18446744073709551616",
    b"99:99",
    b"0000-00-00T00:00:00Z",
)


_TABLE = {"header": True, "header_lines": 0, "delimiter": ",", "decimal": ".", "time_unit": "s", "rate_hz": None}
_TABLE |= {"time_column": "t", "rows": {}, "gap_tolerance": 0.2}
FITTING: tuple[dict[str, Any], ...] = (
    _TABLE,
    {**_TABLE, "delimiter": "whitespace"},
    {**_TABLE, "delimiter": ";", "decimal": ","},
    {**_TABLE, "delimiter": "tab"},
    _TABLE,
    _TABLE,
    {**_TABLE, "time_unit": "clock"},
    {**_TABLE, "time_unit": "ns"},
    {"header": False, "header_lines": 0, "delimiter": "whitespace", "time_column": None, "rate_hz": 100.0, "rows": {}}
    | {"channels": [{"name": "gyro_x", "column": 1, "quantity": "angular_rate", "unit": "count"}]},
    *(_TABLE for _ in range(8)),
)
"""Fields that fit each of the whole files; the rest of a description is by chance."""


class HostileFiles:
    """Files by their number: `file` gives the bytes and the description."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        rng = np.random.Generator(np.random.PCG64(seed))
        self._whole = [*_texts(rng), *_columnar(rng)]

    def file(self, number: int) -> tuple[bytes, dict[str, Any]]:
        """File and description of a number."""
        rng = np.random.Generator(np.random.PCG64([self._seed, number]))
        if rng.random() < 0.1:
            return _random(rng), _description(rng)
        whole = int(rng.integers(len(self._whole)))
        data = bytearray(self._whole[whole])
        for _ in range(int(rng.integers(0, 4))):
            data = _mutated(data, self._whole, rng)
        packed = rng.random() < 0.1
        found = gzip.compress(bytes(data), 1) if packed else bytes(data)
        if packed and rng.random() < 0.3:
            found = bytes(_mutated(bytearray(found), self._whole, rng))
        return found, _description(rng) | (FITTING[whole] if rng.random() < 0.8 else {})


def _texts(rng: np.random.Generator) -> list[bytes]:
    t = 0.01 * np.arange(ROWS)
    x, y = rng.normal(0.0, 1.0, ROWS), rng.integers(-1000, 1000, ROWS)
    plain = "t,x,y\n" + "".join(f"{a:.3f},{b:.6f},{c}\n" for a, b, c in zip(t, x, y, strict=True))
    clock = "t,x,y\n" + "".join(
        f"00:{int(a) // 60:02d}:{a % 60:06.3f},{b:.6f},{c}\n" for a, b, c in zip(t, x, y, strict=True)
    )
    stamps = "t,x,y\n" + "".join(
        f"{1403636579758555392 + 10_000_000 * i},{b:.6f},{c}\n" for i, (b, c) in enumerate(zip(x, y, strict=True))
    )
    return [
        plain.encode(),
        plain.replace(",", "  ").encode(),
        plain.replace(",", ";").replace(".", ",").encode(),
        plain.replace(",", "\t").encode("utf-16"),
        plain.replace("\n", "\r").encode(),
        ("#" + plain).encode(),
        clock.encode(),
        stamps.encode(),
        b"1 2 3\n" * ROWS,
    ]


def _columnar(rng: np.random.Generator) -> list[bytes]:
    data = pa.table(
        {
            "t": pa.array(10_000_000 * np.arange(ROWS), pa.timestamp("ns")),
            "x": rng.normal(0.0, 1.0, ROWS),
            "y": rng.integers(-9, 9, ROWS).astype(np.int16),
            "s": ["word"] * ROWS,
        }
    )
    found: list[bytes] = []
    for compression in ("snappy", "zstd", "none", "gzip"):
        sink = io.BytesIO()
        pq.write_table(data, sink, compression=compression, row_group_size=100, use_dictionary=compression == "snappy")
        found.append(sink.getvalue())
    for make in (pa.ipc.new_file, pa.ipc.new_stream):
        for codec in (None, "lz4"):
            sink = io.BytesIO()
            with make(sink, data.schema, options=pa.ipc.IpcWriteOptions(compression=codec)) as writer:
                writer.write_table(data, max_chunksize=100)
            found.append(sink.getvalue())
    return found


def _random(rng: np.random.Generator) -> bytes:
    size = int(rng.integers(0, 4000))
    alphabets = (bytes(range(256)), b'0123456789.,;-+eE \t\r\n"#%', b"\x00\x01\xff\xfe1,\n", b"  \t 1\n")
    alphabet = np.frombuffer(alphabets[rng.integers(len(alphabets))], np.uint8)
    magic = (b"", b"PAR1", b"ARROW1\x00\x00", b"\xff\xff\xff\xff", b"\x1f\x8b\x08", b"t,x,y\n")[rng.integers(6)]
    body = alphabet[rng.integers(0, len(alphabet), size)].tobytes()
    return magic + body + (b"PAR1" if magic == b"PAR1" else b"")


def _mutated(data: bytearray, others: list[bytes], rng: np.random.Generator) -> bytearray:
    """One change of a kind that files suffer, or that somebody thought of."""
    kind, size = int(rng.integers(9)), max(1, len(data))
    at = int(rng.integers(size))
    if kind == 0:
        for place in rng.integers(0, size, int(rng.integers(1, 9))):
            if len(data):
                data[int(place)] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        del data[at:]
    elif kind == 2:
        del data[at : at + int(rng.integers(1, 200))]
    elif kind == 3:
        data[at:at] = data[at : at + int(rng.integers(1, 500))] * int(rng.integers(1, 5))
    elif kind == 4:
        other = others[rng.integers(len(others))]
        data[at:] = other[int(rng.integers(len(other))) :]
    elif kind == 5:
        data[at : at + int(rng.integers(0, 10))] = EXTREMES[rng.integers(len(EXTREMES))]
    elif kind == 6:
        data[at:at] = (b" ", b"\t", b",", b'"', b"\n", b"\x00", b"1")[rng.integers(7)] * int(rng.integers(1, 100_000))
    elif kind == 7:
        cells = bytes(data).split(b",")
        cells[int(rng.integers(len(cells)))] = EXTREMES[rng.integers(len(EXTREMES))]
        data = bytearray(b",".join(cells))
    else:
        data[at : at + 4] = int(rng.integers(0, 2**32)).to_bytes(4, "little")
    return data


def _description(rng: np.random.Generator) -> dict[str, Any]:
    """A description that fits the whole files, more or less."""

    def one(*choices: Any) -> Any:
        return choices[rng.integers(len(choices))]

    channel = {"name": "gyro_x", "column": one("x", "x", 1), "quantity": "angular_rate", "unit": one("rad/s", "deg/h")}
    second = {"name": "gyro_y", "column": one("y", 2), "quantity": "angular_rate", "unit": "count"}
    if rng.random() < 0.2:
        second |= {"quantity": "angle", "unit": one("deg", "count"), "period": one(360.0, 1e-300, 65536)}
    timed = rng.random() < 0.7
    return {
        "unit": "FUZZ-1",
        "channels": [channel, second] if rng.random() < 0.7 else [channel],
        "rate_hz": one(None, 100.0, 1e-300, 1e300) if timed else 100.0,
        "time_column": one("t", "t", 0) if timed else None,
        "time_unit": one("s", "ms", "us", "ns", "clock"),
        "delimiter": one(",", ",", ",", ";", "tab", "whitespace"),
        "decimal": one(".", ".", ","),
        "header": bool(rng.random() < 0.9),
        "header_lines": int(one(0, 0, 0, 1, 10_000)),
        "gaps": one("refuse", "mark"),
        "repeats": one("refuse", "drop"),
        "unwrap_clock": bool(rng.random() < 0.3),
        "clock_fraction": one("decimal", "ms", "us"),
        "rows": one({}, {}, {"first": 2}, {"first": 5, "last": 200}, {"first": 10**9}),
        "gap_tolerance": float(one(0.2, 1e-300, 0.999)),
    }


def checksum(data: bytes) -> int:
    """To name a file in a report."""
    return zlib.crc32(data)
