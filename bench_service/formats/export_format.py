"""File formats of exported recordings, by name; `bench_service.formats.export` writes them."""

from enum import StrEnum


class ExportFormat(StrEnum):
    """File format of an exported recording."""

    ARROW = "arrow"
    PARQUET = "parquet"
    CSV = "csv"
    NPY = "npy"

    @property
    def media_type(self) -> str:
        """Return the format's media type for HTTP."""
        return {
            "arrow": "application/vnd.apache.arrow.stream",
            "parquet": "application/vnd.apache.parquet",
            "csv": "text/csv; charset=utf-8",
            "npy": "application/octet-stream",
        }[self.value]
