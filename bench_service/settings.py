"""Settings of the service: one frozen model, read from the environment once, in `__main__`."""

from collections.abc import Mapping
from ipaddress import ip_network
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from bench_service.device_folder import BENCH_ID, DATABASE_URL, bench_id_in, device_folder

LEAST_TOKEN = 20
"""Number of characters of the shortest valid token."""


class BadSettings(Exception):
    """Raised where a setting from the environment is not usable; the message names it."""


def _listed(given: object) -> object:
    """The parts of a comma-separated list."""
    return tuple(part for part in map(str.strip, given.split(",")) if part) if isinstance(given, str) else given


def _network(given: str) -> str:
    """Check an address or a network. Raises `ValueError`."""
    return str(ip_network(given))


HostName = Annotated[str, Field(pattern=r"^(\[[0-9a-fA-F:.]+\]|[A-Za-z0-9._-]+)(:[0-9]{1,5})?$")]
Network = Annotated[str, AfterValidator(_network)]


class Settings(BaseModel):
    """All settings of the service, checked and frozen. Each is read from the variable `BENCH_` + its name in capitals,
    once, in `__main__`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    database_url: str = DATABASE_URL
    """`sqlite:///file` (embedded, one machine) or `postgresql+psycopg://…`."""
    host: str = "127.0.0.1"
    """An address other than a loopback one needs an account, a token (stored, or `token_file`) or `published`."""
    hosts: Annotated[tuple[HostName, ...], BeforeValidator(_listed)] = ()
    """Names that requests may use, besides the loopback ones, comma-separated: those of a proxy, of a container.

    With a port (`bench.example:8443`) only that port."""
    token_file: Path | None = None
    """File with the token that programs send from elsewhere than this host, as `Authorization: Bearer …`.

    The service asks for it, and commands with `--server` send it."""
    proxy_user_header: str | None = Field(None, pattern=r"^[A-Za-z][A-Za-z0-9-]{0,63}$")
    """Header in which a reverse proxy names the person that it has authenticated (`X-Forwarded-User`): an account's."""
    proxy_addresses: Annotated[tuple[Network, ...], BeforeValidator(_listed)] = ()
    """Addresses or networks of the proxies whose word is taken for that, comma-separated; from any other the header is
    refused."""
    published: Literal["loopback"] | None = None
    """`loopback`: the service's address is reached only through a port published on a loopback address (a container's),
    or through a proxy there that lets in only people it knows; then every peer counts as one of this host."""
    port: int = Field(8000, ge=0, le=65535)
    bench_id: str = Field(BENCH_ID, pattern=r"^[a-z0-9][a-z0-9_-]{0,31}$")
    """Id of the bench that this process drives."""
    bench_file: Path | None = None
    """Bench file of the bench that this process drives, with its id; None: the bench is simulated."""
    unit_truth: Path | None = None
    """Truth file of the simulated unit; None: the one that ships."""
    bench_truth: Path | None = None
    """Truth file of the simulated table and site; None: the one that ships."""
    real_time_factor: float | None = Field(None, gt=0)
    """Simulated seconds per real second; None: as fast as the machine allows."""
    device_folder: Path | None = None
    """Folder where a simulated bench's devices keep their state; None: with the SQLite file, in .bench/ for Postgres.

    A folder of the bench's own host, the same for every process of that bench."""
    backup_folder: Path | None = None
    """Folder for the copy that is made before a newer version changes the database's tables; None: next to an SQLite
    file, in the device folder for Postgres."""
    scrub_at: str = Field("03:30", pattern=r"^(|([01][0-9]|2[0-3]):[0-5][0-9])$")
    """Time of day, on this host's clock, of the nightly check of the database by a process that drives a bench; empty:
    none."""
    raw_days: float | None = Field(None, gt=0)
    """Days after which the raw data of routine passes are removed, each night; None: never."""
    archive: str | None = Field(None, min_length=1)
    """Archive of raw data: a folder, or `s3://bucket/prefix` with the store's options; None: none."""
    archive_days: float | None = Field(None, gt=0)
    """Days after which raw data are moved to the archive, each night; None: only when a person asks for it."""
    stop_listen: str = Field("127.0.0.1:0", pattern=r"^(|\S+:\d{1,5})$")
    """Address at which a bench's supervisor takes stops from other hosts, `host:port`, port 0 for any; empty: none.

    The API connects to this name too; over a network it is one that the API's host can resolve."""
    stop_secret_file: Path | None = None
    """Secret that supervisors and APIs of a deployment share, 16 bytes or more; None: the device folder's own."""
    device_faults: str | None = None
    """Faults put into a simulated bench's devices, for exercises (see `bench_service.drivers.device_faults`)."""
    ask_operator: bool = False
    """True where a person is asked, for exercises, to do the work of the simulated bench's operator."""
    poll_s: float = Field(0.1, gt=0, le=10)
    """Interval at which a worker looks for jobs that other processes queued [s]; its own it sees at once."""
    drive: bool = True
    """True where `bench serve` drives its bench; false: an API alone, for benches that workers drive."""
    retry_scale: float = Field(1.0, gt=0, le=1)
    """Factor on the pauses before a retry after a fault of the bench (10 s, 30 s, 60 s, …)."""
    audit_days: float | None = Field(None, ge=1)
    """Retention of the audit trail [d]: older entries are removed, and leave a checkpoint; None: all are kept."""
    log: Literal["text", "json"] = "text"
    """Format of the log's lines."""
    log_level: Literal["debug", "info", "warning", "error"] | None = None
    """Lowest level that is logged; None: info for a service, warning for a command that works in this process."""
    log_file: Path | None = None
    """File for the log's lines, rotated at 10 MB, with the five before it kept; None: standard error."""
    log_access: bool = False
    """True where every request is a line of the log."""
    traces_url: str | None = Field(None, pattern=r"^https?://\S+$")
    """Address for traces (OTLP over HTTP, protobuf); None: none, unless OTEL_EXPORTER_OTLP_ENDPOINT gives one."""
    notify: Path | None = None
    """TOML file of mail servers and webhooks that get messages (`docs/who-is-told.md`); None: no messages are sent."""
    max_import_mb: float = Field(1024, gt=0)
    """Largest recording file that may be imported [MB]."""

    @model_validator(mode="before")
    @classmethod
    def _named_by_its_file(cls, given: Any) -> Any:
        """Take the bench's id from its bench file where it is not given."""
        if not isinstance(given, dict) or given.get("bench_file") is None or given.get("bench_id") is not None:
            return given
        found = bench_id_in(Path(given["bench_file"]))
        return given if found is None else {**given, "bench_id": found}

    @model_validator(mode="after")
    def _proxy_is_whole(self) -> "Settings":
        if (self.proxy_user_header is None) != (not self.proxy_addresses):
            raise ValueError("BENCH_PROXY_USER_HEADER and BENCH_PROXY_ADDRESSES are given together, or neither is")
        return self

    def stop_secret_in(self) -> Path:
        """Return the file of the secret under which a stop goes to another host."""
        return self.stop_secret_file or self.devices_in() / "bench-stop.secret"

    def copies_in(self) -> Path | None:
        """Return the folder of copies made before a migration; None: next to the SQLite file."""
        if self.backup_folder is not None or self.database_url.startswith("sqlite"):
            return self.backup_folder
        return self.devices_in()

    def token(self) -> str | None:
        """Return the token in the file `token_file`; None where the settings name none. Raises `BadSettings`."""
        if self.token_file is None:
            return None
        try:
            words = self.token_file.read_text(encoding="utf-8").split()
        except OSError as error:
            raise BadSettings(f"BENCH_TOKEN_FILE {self.token_file} cannot be read: {error.strerror}") from error
        except UnicodeDecodeError as error:
            raise BadSettings(f"BENCH_TOKEN_FILE {self.token_file} is not UTF-8 text") from error
        if len(words) != 1 or len(words[0]) < LEAST_TOKEN or not words[0].isascii():
            text = f"must hold one token of at least {LEAST_TOKEN} letters, digits or signs"
            raise BadSettings(f"BENCH_TOKEN_FILE {self.token_file} {text}")
        return words[0]

    def devices_in(self) -> Path:
        """Return the folder of the bench's device files (registers, stop channel, heartbeat)."""
        return device_folder(self.database_url, self.device_folder)

    @classmethod
    def from_environ(cls, environ: Mapping[str, str]) -> "Settings":
        """Return the settings from a mapping such as ``os.environ``. Raises `BadSettings`, also for an unknown `BENCH_`
        variable.
        """
        unknown = sorted(key for key in environ if key.startswith("BENCH_") and key not in cls.variables())
        if unknown:
            raise BadSettings(f"{unknown[0]} is not a setting; the settings are {', '.join(cls.variables())}")
        given = {name: environ[key] for name in cls.model_fields if (key := _variable(name)) in environ}
        collector = environ.get("OTEL_EXPORTER_OTLP_ENDPOINT")
        if collector and "traces_url" not in given:
            given["traces_url"] = collector.rstrip("/") + "/v1/traces"
        try:
            return cls.model_validate(given)
        except ValidationError as error:
            first = error.errors()[0]
            if not first["loc"]:
                raise BadSettings(str(first["msg"]).removeprefix("Value error, ")) from error
            name = _variable(str(first["loc"][0]))
            raise BadSettings(f"{name} = {given.get(str(first['loc'][0]))!r}: {first['msg']}") from error

    @classmethod
    def variables(cls) -> tuple[str, ...]:
        """Return the names of all environment variables that are read."""
        return tuple(_variable(name) for name in cls.model_fields)


def _variable(field: str) -> str:
    """The environment variable of a field: bench_truth is BENCH_TRUTH."""
    return f"BENCH_{field.removeprefix('bench_').upper()}"
