"""Routes of trends: a quantity of a unit over its results, with control limits."""

from typing import Annotated

from fastapi import Query

from bench_service.api.campaigns.schemas import TrendView
from bench_service.api.http.dependencies import Service
from bench_service.api.http.errors import problems
from bench_service.api.http.fields import NAME
from bench_service.routing import Routes

router = Routes(prefix="/api/v1/units", tags=["campaigns"])


@router.get("/{serial}/trend", responses=problems(404))
def read_trend(
    serial: str,
    service: Service,
    quantity: Annotated[
        str, Query(max_length=200, description="A check's name, an estimate's (gyro.b_x), or a JSON pointer")
    ],
    procedure: Annotated[str, NAME],
    simulated: Annotated[bool | None, Query(description="Null: results of the kind that this bench gives")] = None,
    same_parameters: Annotated[bool, Query(description="Only results with the newest one's parameters")] = False,
    limit: Annotated[int, Query(ge=2, le=500, description="The latest results")] = 100,
) -> TrendView:
    """Read the trend of a quantity over the results that gave verdicts: a control chart with Western Electric rules."""
    return TrendView.of(service.campaigns.trend(serial, procedure, quantity, simulated, limit, same_parameters))
