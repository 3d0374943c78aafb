"""Interface of device drivers: addresses, limits of file and device, and the registry with installed packages."""

from importlib.metadata import EntryPoint

import pytest
from pydantic import ValidationError

from bench_service.drivers.interface import registry
from bench_service.drivers.interface.address import Address
from bench_service.drivers.interface.driver import Bound, DeviceDriver, differences, narrowed
from bench_service.drivers.interface.sections import WireChamber, WireTurntable
from bench_service.model.errors import Misconfigured


@pytest.mark.parametrize(
    "text",
    ["tcp://10.1.0.11:9878", "udp://0.0.0.0:7000", "tcp://[::1]:2049", "serial:///dev/ttyS0?baud=115200&format=8E1"],
)
def test_an_address_is_read_and_written(text: str) -> None:
    assert str(Address.parse(text)) == text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("10.1.0.11:9878", "give tcp://"),
        ("tcp://10.1.0.11", "port from 1 to 65535"),
        ("tcp://10.1.0.11:99999", "port from 1 to 65535"),
        ("tcp://10.1.0.11:80/path", "give tcp://"),
        ("serial://dev/ttyS0", "give tcp://"),
        ("serial:///dev/ttyS0?baud=fast", "baud = 'fast'"),
        ("serial:///dev/ttyS0?speed=1", "no 'speed'"),
    ],
)
def test_a_wrong_address_is_refused_with_the_right_form(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Address.parse(text)


CHAMBER = WireChamber.model_validate(
    {
        "driver": "oven",
        "address": "tcp://127.0.0.1:2049",
        "limits": {"minimum_c": -55.0, "maximum_c": 85.0, "ramp_c_min": 3.0, "ambient_c": 22.0},
    }
)


def test_the_narrower_of_two_limits_holds_and_the_difference_is_said() -> None:
    own = (
        Bound("limits.minimum_c", -40.0),
        Bound("limits.maximum_c", 180.0),
        Bound("limits.ramp_c_min", 3.0),
    )
    limits = narrowed(CHAMBER, own).limits
    assert (limits.minimum_c, limits.maximum_c, limits.ramp_c_min) == (-40.0, 85.0, 3.0)
    assert differences(CHAMBER, own) == (
        "limits.minimum_c: the file has -55, the device -40; -40 holds",
        "limits.maximum_c: the file has 85, the device 180; 85 holds",
    )
    assert CHAMBER.limits.minimum_c == -55.0
    with pytest.raises(ValueError, match=r"no limit 'limits\.height_m'"):
        narrowed(CHAMBER, (Bound("limits.height_m", 1.0),))


def test_a_real_table_without_its_axes_is_refused() -> None:
    with pytest.raises(ValidationError, match="outer"):
        WireTurntable.model_validate({"driver": "acutrol", "address": "tcp://127.0.0.1:9878"})


OVEN = DeviceDriver("chamber", "oven", WireChamber, lambda section, context: (section, context))


def _installed(monkeypatch: pytest.MonkeyPatch, *entries: EntryPoint) -> None:
    def found(*, group: str, name: str | None = None) -> tuple[EntryPoint, ...]:
        return tuple(e for e in entries if e.group == group and name in (None, e.name))

    monkeypatch.setattr(registry, "entry_points", found)


def test_a_package_of_the_laboratory_brings_its_driver(monkeypatch: pytest.MonkeyPatch) -> None:
    _installed(monkeypatch, EntryPoint("oven", f"{__name__}:OVEN", registry.GROUP))
    assert registry.driver("chamber", "oven") is OVEN
    assert registry.names("chamber")[0] == "simulated"
    assert "oven" in registry.names("chamber")
    with pytest.raises(Misconfigured, match="no such driver of a supply"):
        registry.driver("supply", "oven")


def test_a_package_that_cannot_be_loaded_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    _installed(
        monkeypatch,
        EntryPoint("broken", "tests.no_such_module:DRIVER", registry.GROUP),
        EntryPoint("other", f"{__name__}:OVEN", registry.GROUP),
    )
    with pytest.raises(Misconfigured, match=r"broken.*cannot be loaded"):
        registry.driver("chamber", "broken")
    with pytest.raises(Misconfigured, match="not a DeviceDriver of that name"):
        registry.driver("chamber", "other")
    with pytest.raises(Misconfigured, match="there is simulated"):
        registry.driver("chamber", "nothing")


def test_two_packages_with_one_name_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = EntryPoint("oven", f"{__name__}:OVEN", registry.GROUP)
    _installed(monkeypatch, entry, entry)
    with pytest.raises(Misconfigured, match="2 installed packages"):
        registry.driver("chamber", "oven")


def test_every_shipped_driver_can_be_imported() -> None:
    for (kind, name), where in registry.SHIPPED.items():
        made = registry.driver(kind, name)
        assert (made.kind, made.name) == (kind, name), where
