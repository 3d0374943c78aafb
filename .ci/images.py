"""Pin the images of `docker-compose.yml` by their digests, and build the service's own, where a container engine is.

`make images`. An image that is pinned already is asked for anew by its tag. Without an engine nothing is changed: exit
code 2.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
IMAGE = re.compile(
    r"(?P<before>^\s*(?:FROM|image:)\s+)(?P<name>[a-z0-9./_-]+:[A-Za-z0-9._-]+)(?:@sha256:[0-9a-f]{64})?(?=\s|$)", re.M
)
"""An image with a tag, pinned or not; the service's own, "bench", has none."""
DIGEST = re.compile(r"sha256:[0-9a-f]{64}")


def names(text: str) -> list[str]:
    """Return the images that a compose file takes from a registry, each once."""
    return list(dict.fromkeys(found["name"] for found in IMAGE.finditer(text)))


def pinned(text: str, digests: dict[str, str]) -> str:
    """Return the compose file with each image that has a digest pinned by it."""

    def pin(found: re.Match[str]) -> str:
        digest = digests.get(found["name"])
        return found[0] if digest is None else f"{found['before']}{found['name']}@{digest}"

    return IMAGE.sub(pin, text)


def digest_of(engine: str, name: str) -> str | None:
    """Ask the registry for an image's digest; None where it does not answer."""
    command = [engine, "buildx", "imagetools", "inspect", name, "--format", "{{.Manifest.Digest}}"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        print(f"{name}: {error}")
        return None
    found = DIGEST.search(done.stdout)
    if done.returncode != 0 or found is None:
        print(f"{name}: no digest: {done.stderr.strip()[:200]}")
        return None
    return found[0]


def main(compose: Path = ROOT / "docker-compose.yml") -> int:
    """Resolve and pin the images, then build; return the exit code."""
    engine = shutil.which("docker")
    if engine is None:
        print("no container engine is here: images are neither pinned nor built")
        return 2
    text = compose.read_text()
    digests = {name: digest for name in names(text) if (digest := digest_of(engine, name)) is not None}
    for name, digest in digests.items():
        print(f"{name}: {digest}")
    changed = pinned(text, digests)
    if changed != text:
        compose.write_text(changed)
    if len(digests) < len(names(text)):
        print("not every registry answered: nothing was built")
        return 1
    return subprocess.run([engine, "compose", "-f", compose, "build"], check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
