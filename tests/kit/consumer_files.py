"""Reading of a consumer's file by the consumer's documents, and mistakes that a reader or a writer could make."""

import json
from collections.abc import Callable

import numpy as np

Numbers = dict[str, np.ndarray]
"""Offset and matrix as a consumer's file has them, and what else it has."""
OF_THE_OFFSET: dict[str, Callable[[Numbers], Numbers]] = {
    "sign of the offset": lambda n: {**n, "offset": -n["offset"]},
    "order of the offset": lambda n: {**n, "offset": n["offset"][::-1]},
}
OF_THE_MATRIX: dict[str, Callable[[Numbers], Numbers]] = {
    "order of the axes": lambda n: {**n, "matrix": n["matrix"][::-1, ::-1]},
    "transposed matrix": lambda n: {**n, "matrix": n["matrix"].T},
    "inverted matrix": lambda n: {**n, "matrix": np.linalg.inv(n["matrix"])},
}


def commented_bias(text: str, words: str) -> np.ndarray:
    """The bias in the comment that has these words: Kalibr and OpenVINS have no field for it."""
    (line,) = [x for x in text.splitlines() if x.startswith("#") and words in x]
    return np.array(json.loads(line[line.rindex("[") : line.rindex("]") + 1]))


def assigned(text: str) -> dict[str, np.ndarray]:
    """Matrices that lines of MATLAB assign, by name."""
    found = {}
    for line in text.splitlines():
        name, equals, rest = line.partition(" = [")
        if equals and not line.startswith("%"):
            found[name] = np.array([[float(x) for x in row.split()] for row in rest.partition("]")[0].split(";")])
    return found


def of_ardupilot(text: str) -> dict[str, float]:
    """Parameters of ArduPilot by name."""
    rows = [line.split(",") for line in text.splitlines() if not line.startswith("#")]
    return {name: float(value) for name, value in rows}


def of_px4(text: str) -> dict[str, float]:
    """Parameters of PX4 by name."""
    rows = [line.split("\t") for line in text.splitlines() if not line.startswith("#")]
    return {row[2]: float(row[3]) for row in rows}


def stated_loss(text: str, words: str) -> float:
    """Length of the vector of losses in the line that has these words."""
    (line,) = [x for x in text.splitlines() if words in x]
    sizes = [float(word) for word in line.partition("up to ")[2].replace(",", "").split() if word[0].isdigit()]
    return float(np.linalg.norm(sizes))
