"""Printed reports for those who ask: of a result, of a unit, of a certificate, each as the bytes of a PDF/A-3."""

import base64
from collections.abc import Callable

from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.reports.result_report import gathered, result_report
from bench_service.evidence.reports.unit_report import unit_report
from bench_service.evidence.stores import EvidenceStores
from bench_service.evidence.work_processes import WorkProcesses
from bench_service.formats.printed.document import PrintedDocument
from bench_service.model.job import Job


class ReportService:
    """Makes printed reports from what is stored, and has them typeset in a printing process."""

    def __init__(
        self,
        stores: EvidenceStores,
        catalogue: Catalogue,
        read_job: Callable[[str], Job],
        processes: WorkProcesses | None = None,
    ) -> None:
        """Set up with `processes`, where reports are typeset; None: here, in the caller's thread."""
        self._stores = stores
        self._catalogue = catalogue
        self._read_job = read_job
        self._processes = processes

    def of_result(self, result_id: str) -> bytes:
        """Return the report of a result as PDF/A-3, with its document attached. Waits for the typesetting. Raises
        `NotFound`.
        """
        result = self._stores.results.get(result_id)
        job = None if result.job_id is None else self._read_job(result.job_id)
        return self._typeset(result_report(self._stores, self._catalogue, gathered(self._stores, result, job)))

    def of_unit(self, serial: str) -> bytes:
        """Return the report of a unit as PDF/A-3. Waits for the typesetting. Raises `NotFound`."""
        return self._typeset(unit_report(self._stores, serial))

    def of_certificate(self, serial: str, xml: str) -> bytes:
        """Return the printed form of a unit's certificate as PDF/A-3, to which the XML is attached byte for byte. Waits
        for the typesetting. Raises `BadParameter`.
        """
        from bench_service.evidence.reports.certificate_report import certificate_report  # with scipy and signxml

        return self._typeset(certificate_report(self._stores, self._catalogue, self._read_job, serial, xml.encode()))

    def _typeset(self, document: PrintedDocument) -> bytes:
        if self._processes is not None:
            return base64.b64decode(self._processes.result("print", document))
        from bench_service.formats.printed.typesetting import typeset

        return typeset(document)
