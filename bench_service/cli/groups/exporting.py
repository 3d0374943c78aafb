"""The command that takes samples out: of a recording as a file, of a job as a zip."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bench_service.cli.asking.client import check, connect, segment
from bench_service.cli.files import check_folder, whole_file
from bench_service.cli.options import Server, console, notice
from bench_service.cli.refusal import Refused

if TYPE_CHECKING:
    import httpx

AS_STORED = ("csv", "parquet", "arrow", "npy")
"""Formats in which stored samples go out with the description that brings the recording back."""
FORMATS = (*AS_STORED, "feather", "h5", "mat", "mcap")
WITHOUT_FACTS = ("csv", "npy")
"""Formats in which a table of samples has no place for its origin."""


def export(
    context: typer.Context,
    recording: Annotated[str, typer.Argument(help="Id of a recording; of a job, where the file is a .zip")],
    output: Annotated[
        Path, typer.Option("--output", "-o", dir_okay=False, help="File to write; its suffix is the format")
    ],
    channels: Annotated[str | None, typer.Option(help="Names, separated by commas; all without it")] = None,
    start_s: Annotated[float | None, typer.Option(help="Begin, in seconds of the recording")] = None,
    stop_s: Annotated[float | None, typer.Option(help="End, in seconds of the recording")] = None,
    values: Annotated[
        str | None,
        typer.Option(
            help="physical (SI, units in the names) or raw (a plain table of what is stored). Without it raw in every "
            "format, but physical with --corrected-by or --decimate, and in .mcap, which holds nothing else"
        ),
    ] = None,
    corrected_by: Annotated[
        str | None, typer.Option(help="Calibrations and temperature corrections, ids separated by commas")
    ] = None,
    decimate: Annotated[int | None, typer.Option(min=1, help="Samples that one mean is taken over")] = None,
    form: Annotated[str, typer.Option("--format", help="Format of the files in a .zip")] = "csv",
    server: Server = None,
) -> None:
    """Take a recording's samples out as .csv, .parquet, .arrow, .npy, .feather, .h5, .mat or .mcap; a job's as .zip."""
    of_job = output.suffix == ".zip"
    wanted = form if of_job else output.suffix.removeprefix(".")
    if wanted not in FORMATS:
        what = f"--format {form!r}" if of_job else f"{output}: the suffix {output.suffix!r}"
        raise Refused(f"{what} is none of {', '.join(FORMATS)}{'' if of_job else ', zip (of a job)'}")
    used = values or ("physical" if corrected_by or decimate or wanted == "mcap" else "raw")
    of = "jobs" if of_job else "recordings"
    stored = values is None and used == "raw" and not of_job and wanted in AS_STORED
    path = f"/api/v1/{of}/{segment(recording)}/{'data' if stored else 'samples'}"
    asked = {"corrected_by": corrected_by, "decimate": decimate, "values": None if stored else used}
    part: dict[str, Any] = {"channels": channels, "start_s": start_s, "stop_s": stop_s}
    if of_job and any(v is not None for v in part.values()):
        raise Refused("--channels, --start-s and --stop-s are of one recording: a .zip has a job's whole recordings")
    query = {"format": wanted, **{k: v for k, v in {**part, **asked}.items() if v is not None}}
    check_folder(output)
    with (
        connect(context.obj, server, drive=False) as client,
        client.stream("GET", path, params=query) as response,
    ):
        check(response)
        with whole_file(output) as sink:
            for piece in response.iter_bytes():
                sink.write(piece)
    console.print(f"{output}: {output.stat().st_size} bytes, {used} values", soft_wrap=True)
    if not stored and not of_job and wanted in WITHOUT_FACTS:
        _say_origin(response, output)


def _say_origin(response: "httpx.Response", output: Path) -> None:
    """Say that samples are simulated where neither their format nor the name that a person gave says so."""
    if "-simulated." in response.headers.get("content-disposition", "") and "-simulated." not in output.name:
        notice(
            f"the samples are simulated, and {output.suffix} has no place to say so: with a name that ends in "
            f"-simulated{output.suffix} the file stays simulated when it is imported"
        )
