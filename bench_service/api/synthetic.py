"""Route of synthetic recordings: a channel of chosen noise, to try a method on."""

from typing import Annotated, Literal

from fastapi import Response
from pydantic import Field

from bench_service.api.http.dependencies import IdempotencyKey, Service
from bench_service.api.http.errors import made, problems
from bench_service.api.http.fields import Request
from bench_service.api.recording_views import RecordingView
from bench_service.evidence.imports import Synthesis
from bench_service.routing import Routes
from procedures.core import units
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import Channel, Quantity

router = Routes(prefix="/api/v1/recordings", tags=["recordings"])
Coefficient = Annotated[float, Field(ge=0.0, le=1e6, allow_inf_nan=False)]

KINDS = {
    "gyro": (Quantity.ANGULAR_RATE, "rad/s"),
    "accelerometer": (Quantity.SPECIFIC_FORCE, "m/s^2"),
}


class SyntheticRequest(Request):
    """Noise of a synthetic recording, in the units that people read it in: those of its kind."""

    kind: Literal["gyro", "accelerometer"] = "gyro"
    quantization: Coefficient = Field(0.0, description="Q in arcsec, or µg·s")
    random_walk: Coefficient = Field(0.0, description="N in deg/√h, or µg·√s")
    bias_instability: Coefficient = Field(0.0, description="B in deg/h, or µg")
    rate_random_walk: Coefficient = Field(0.0, description="K in deg/h/√h, or µg/√s")
    rate_ramp: Coefficient = Field(0.0, description="R in deg/h/h, or µg/s")
    rate_hz: float = Field(100.0, gt=0.0, le=10_000.0, allow_inf_nan=False)
    duration_s: float = Field(3600.0, gt=0.0, le=5e7, allow_inf_nan=False)
    seed: int = Field(1, ge=0, le=2**63 - 1)

    def synthesis(self) -> Synthesis:
        """Return the request with its coefficients converted to SI units. Raises `BadParameter`."""
        quantity, unit = KINDS[self.kind]
        sizes = {name: size for name, (_, size) in units.NOISE_DISPLAY[unit].items()}
        noise = NoiseCoefficients(**{name: getattr(self, name) * size for name, size in sizes.items()})
        return Synthesis(Channel(f"{self.kind}_x", quantity, unit), noise, self.rate_hz, self.duration_s, self.seed)


@router.post(
    "/synthetic",
    status_code=201,
    responses={**problems(409, 413, 503, 507), **made(201, "recording_id", "read_recording")},
)
def synthesise_recording(
    body: SyntheticRequest, service: Service, response: Response, key: IdempotencyKey = None
) -> RecordingView:
    """Make a recording of chosen noise. It is marked as synthetic for ever, and joins no unit's history or trend."""
    info = service.imports.synthesise(body.synthesis(), key)
    response.headers["Location"] = f"/api/v1/recordings/{info.id}"
    return RecordingView.of(service.stores.recordings.get(info.id))
