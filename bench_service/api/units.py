"""Units under test: what is declared of them, and their calibrations."""

from typing import Annotated

from fastapi import APIRouter, Path

from bench_service.api.dependencies import After, Limit, Service
from bench_service.api.errors import problems
from bench_service.api.requests import UnitDeclaration
from bench_service.api.schemas import CalibrationPage, CalibrationView, UnitView
from procedures.core.unit import SERIAL, Unit

router = APIRouter(prefix="/api/v1/units", tags=["units"])
Serial = Annotated[str, Path(pattern=SERIAL)]


@router.get("")
def list_units(service: Service) -> list[UnitView]:
    """Every unit that is known."""
    return [UnitView.of(unit) for unit in service.stores.units.units()]


@router.get("/{serial}", responses=problems(404))
def read_unit(serial: str, service: Service) -> UnitView:
    """One unit."""
    return UnitView.of(service.stores.units.unit(serial))


@router.put("/{serial}", responses=problems(507))
def declare_unit(serial: Serial, body: UnitDeclaration, service: Service) -> UnitView:
    """Declare a unit or change what is declared. Its recordings, results and calibrations stay."""
    service.stores.units.put_unit(
        Unit(
            serial,
            body.sample_rate_hz,
            tuple(body.channels),
            body.gyro,
            body.accelerometer,
            body.averaging_time_s,
        )
    )
    return UnitView.of(service.stores.units.unit(serial))


@router.get("/{serial}/calibrations", responses=problems(404))
def list_calibrations(serial: str, service: Service, after: After = None, limit: Limit = 50) -> CalibrationPage:
    """The unit's calibrations, newest first; one is current."""
    service.stores.units.unit(serial)
    page = service.stores.results.calibrations(serial, after=after, limit=limit)
    return CalibrationPage(items=[CalibrationView.of(c) for c in page.items], next=page.next)
