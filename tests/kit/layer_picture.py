"""Pictures of the layers in docs/architecture.md, made from the import contracts by `make pictures`."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "architecture.md"
CONTAINERS = ("bench_service", "simulators", "procedures")
WIDTH = 100


def layers_of(container: str) -> list[list[str]]:
    """Rows of a package from the top, each with the modules that stand side by side, as its contract has them."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (found,) = (c for c in contracts if c["type"] == "layers" and c.get("containers") == [container])
    return [[name.strip() for name in row.split("|")] for row in found["layers"]]


def picture(container: str) -> str:
    """Heading and boxes of one package, as they stand in the page."""
    lines = [f"### `{container}`", "", "```text", "┌" + "─" * WIDTH + "┐"]
    for number, row in enumerate(layers_of(container)):
        if number:
            lines.append("├" + "─" * WIDTH + "┤")
        text = " │ ".join(row)
        assert len(text) <= WIDTH, f"a row of {container} is wider than the picture: {text}"
        lines.append("│" + text.center(WIDTH) + "│")
    return "\n".join([*lines, "└" + "─" * WIDTH + "┘", "```"])


def pictures() -> str:
    """All three packages, from the top."""
    return "\n\n".join(picture(container) for container in CONTAINERS) + "\n"


def replaced(page: str) -> str:
    """The page with the pictures of today's contracts between its headings "Layers" and "Boundaries"."""
    return re.sub(
        r"(?:LAYERS\n|### `bench_service`\n.*?)(?=## Boundaries)", lambda _: pictures() + "\n", page, flags=re.DOTALL
    )


if __name__ == "__main__":
    PAGE.write_text(replaced(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
