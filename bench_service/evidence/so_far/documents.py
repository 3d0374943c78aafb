"""Shape of the JSON of a job's estimates so far, from the recorded part of the job."""

from pydantic import BaseModel, Field


class AllanDocument(BaseModel):
    """Overlapping Allan deviation of a channel over the dwell so far, with its one-sigma interval."""

    channel: str
    unit: str
    tau_s: list[float]
    deviation: list[float]
    lower: list[float]
    upper: list[float]


class BiasDocument(BaseModel):
    """Kalman estimate of a channel's constant output over the dwell so far: bias, and the input of the orientation."""

    channel: str
    unit: str
    estimate: float
    standard_uncertainty: float
    at_s: list[float] = Field(description="Time since the first sample of each point of the course [s]")
    course: list[float]
    course_uncertainty: list[float]
    innovations_rms: float = Field(description="About 1 where the noise is as it was taken; well above: it is not")
    noise_known: bool = Field(description="Whether the noise is the unit's; else it is taken from the dwell itself")


class DwellEstimates(BaseModel):
    """Estimates of the recording that is being made, or of the last one: Allan deviations and biases by channel."""

    recording: str
    station: int | None
    label: str
    recorded_s: float = Field(description="Length of the part that the estimates rest on [s]")
    allan: list[AllanDocument]
    bias: list[BiasDocument]
    not_estimated: dict[str, str] = Field(description="Channel -> why it has no estimates yet")


class CoefficientSoFar(BaseModel):
    """Values of one coefficient after the first station, the second, …, with their standard uncertainties."""

    name: str
    unit: str
    values: list[float]
    standard_uncertainties: list[float] = Field(description="From noise, the table's declared flaws and a weak prior")
    determined: bool = Field(description="False: the stations so far do not give it, the prior does")


class TriadEstimates(BaseModel):
    """Coefficients of a triad after each station of the job so far."""

    triad: str
    noise_known: bool
    coefficients: list[CoefficientSoFar]


class JobEstimates(BaseModel):
    """Estimates of a job from its recorded part. The result has the final ones."""

    job: str
    stations_done: int
    dwell: DwellEstimates | None = Field(description="null: nothing is stored yet")
    coefficients: list[TriadEstimates] = Field(
        description="From stations at rest with known angles, after each from the second on"
    )
    not_estimated: dict[str, str] = Field(description="Triad -> why it has no coefficients yet")
