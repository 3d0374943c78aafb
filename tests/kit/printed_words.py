"""Words of a printed report before it is typeset, which takes most of a report's time."""

from bench_service.formats.printed.document import Facts, Heading, Paragraph, PrintedDocument, PrintedTable
from procedures.core.report import Figure


def words_of(document: PrintedDocument) -> str:
    """Cells, facts and titles of a document, a row a line."""
    found: list[str] = []
    for block in document.blocks:
        match block:
            case Facts(rows):
                found += [" ".join(row) for row in rows]
            case PrintedTable():
                found += [block.title, block.note, *(" ".join(row) for row in (block.columns, *block.rows))]
            case Figure():
                found += [block.title, block.y_label]
            case Heading() | Paragraph():
                found.append(block.text)
    return "\n".join(found)
