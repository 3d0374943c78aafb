"""Parts that ship: the runtime image without tools and root, its packages, the audit of licences, and pinned images."""

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
IMAGE: str = yaml.safe_load((ROOT / "docker-compose.yml").read_text())["x-bench"]["build"]["dockerfile_inline"]
PACKAGE = re.compile(r"^([a-z0-9._-]+)(?:\[[a-z,]+\])?==(\S+)", re.MULTILINE)


def script(name: str) -> ModuleType:
    specification = importlib.util.spec_from_file_location(name, ROOT / ".ci" / f"{name}.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_the_runtime_packages_are_those_of_the_lock_without_development_tools() -> None:
    runtime = dict(PACKAGE.findall((ROOT / ".ci" / "runtime.lock").read_text()))
    everything = dict(PACKAGE.findall((ROOT / "requirements.lock").read_text()))
    assert len(runtime) > 40
    different = {name for name, version in runtime.items() if everything.get(name) != version}
    assert not different, f"make lock: {different}"
    tools = {"pytest", "schemathesis", "hypothesis", "ruff", "basedpyright", "setuptools", "allantools", "psutil"}
    assert not tools & set(runtime)
    assert tools <= set(everything)


def test_the_image_runs_without_root_and_leaves_what_builds_behind() -> None:
    build, runtime = IMAGE.split("\nFROM ", 1)
    assert "runtime.lock" in build
    assert "-r requirements.lock" not in IMAGE, "it has the development tools"
    assert "\nUSER 10001" in runtime
    assert "pip install" not in runtime
    copied = re.findall(r"^COPY (?!--from|\.ci)(\S+)", build, re.MULTILINE)
    assert not {".", "tests", "docs"} & set(copied), "only what runs is copied"
    for name in re.findall(r"^COPY ([a-z_]+) \1$", build, re.MULTILINE):
        assert (ROOT / name).is_dir()
    assert {"procedures", "simulators", "bench_service", "migrations"} <= set(copied)


def test_images_are_pinned_where_a_registry_answers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    images = script("images")
    compose, digest = tmp_path / "compose.yml", "sha256:" + "ab" * 32
    compose.write_text((ROOT / "docker-compose.yml").read_text())
    wanted = images.names(compose.read_text())
    assert [name.split(":")[0] for name in wanted] == ["python", "postgres"]
    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    assert images.main(compose) == 2
    assert "no container engine" in capsys.readouterr().out

    docker = tmp_path / "docker"
    docker.write_text(f"#!{sys.executable}\nimport sys\nprint('{digest}' if sys.argv[1] == 'buildx' else '')\n")
    docker.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert images.main(compose) == 0
    once = compose.read_text()
    assert once.count(f"@{digest}") == 3  # both stages, and the database
    assert images.names(once) == wanted
    assert images.main(compose) == 0
    assert compose.read_text() == once


def test_every_package_at_run_time_has_a_licence_that_may_be_used() -> None:
    audit = script("audit")
    listed, wrong = audit.licences(audit.pinned(ROOT / ".ci" / "runtime.lock"))
    assert wrong == []
    assert {"numpy", "fastapi", "sqlalchemy"} <= {name for name, _, _, place in listed if place == "runtime"}


@pytest.mark.parametrize(
    ("licence", "allowed"),
    [
        ("MIT", True),
        ("GNU Lesser General Public License v3 (LGPLv3)", True),
        ("GPL-3.0-only", False),
        ("AGPL-3.0", False),
        ("MIT AND GNU General Public License v3 (GPLv3)", False),
    ],
)
def test_a_licence_that_binds_the_service_is_refused(licence: str, allowed: bool) -> None:
    audit = script("audit")
    assert bool(audit.ALLOWED.search(licence) and not audit.REFUSED.search(licence)) == allowed
