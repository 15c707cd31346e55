"""Validation of the XML files of an FMU with the standards' own schemas, as FMPy ships them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib import util
from pathlib import Path
from typing import Any

SCHEMAS = {
    (2, "modelDescription.xml"): "fmi2/fmi2ModelDescription.xsd",
    (3, "modelDescription.xml"): "fmi3/fmi3ModelDescription.xsd",
    (3, "sources/buildDescription.xml"): "fmi3/fmi3BuildDescription.xsd",
    (3, "terminalsAndIcons/terminalsAndIcons.xml"): "fmi3/fmi3TerminalsAndIcons.xsd",
    # FMI 2.0 takes the terminals over from FMI 3.0.
    (2, "terminalsAndIcons/terminalsAndIcons.xml"): "fmi3/fmi3TerminalsAndIcons.xsd",
}
"""Schema of a file inside an FMU, by the version of the standard."""
_MOST_SHOWN = 10


def available() -> bool:
    """Whether the schemas are installed."""
    return util.find_spec("fmpy") is not None and util.find_spec("lxml") is not None


def violations(fmi: int, name: str, content: bytes) -> Iterator[str]:
    """Give the violations of its schema by a file, each with its line; nothing for a file that has no schema."""
    if (fmi, name) not in SCHEMAS:
        return
    from lxml import etree

    parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=False)
    try:
        document = etree.fromstring(content, parser)
    except etree.XMLSyntaxError as error:
        yield f"no XML: {error.msg}"
        return
    schema = _schema(SCHEMAS[fmi, name])
    if schema.validate(document):
        return
    entries = list(schema.error_log)
    for entry in entries[:_MOST_SHOWN]:
        yield f"line {entry.line}: {entry.message}"
    if len(entries) > _MOST_SHOWN:
        yield f"{len(entries) - _MOST_SHOWN} further violations of the schema"


@cache
def _schema(name: str) -> Any:
    from lxml import etree

    found = util.find_spec("fmpy")
    assert found is not None
    assert found.origin is not None
    return etree.XMLSchema(file=str(Path(found.origin).parent / "schema" / name))
