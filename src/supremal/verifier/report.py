"""The verdict on a certificate, and how it is told."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from .reading import UnreadableError, check_document, read_document
from .statements import find_false

_SHOWN: Final = 20


@dataclass(frozen=True)
class Report:
    """What came out: the first statement that is false, or why the file cannot be read.

    Parameters
    ----------
    failures
        The name of the statement, where it is false, and what is wrong and would be right, for each place.
    unreadable
        Why the file is no certificate; "" where it is one.
    words
        What a valid certificate says.
    """

    failures: list[tuple[str, str, str]] = field(default_factory=list)
    unreadable: str = ""
    words: list[str] = field(default_factory=list)

    @property
    def verdict(self) -> str:
        """One of "valid", "not valid", "unreadable"."""
        return "unreadable" if self.unreadable else "not valid" if self.failures else "valid"

    @property
    def exit_code(self) -> int:
        """0 if the certificate is valid, 1 if it is not, 2 if it cannot be read."""
        return ("valid", "not valid", "unreadable").index(self.verdict)

    def lines(self) -> Iterator[str]:
        """Tell it in lines: the verdict, and what is claimed, or what is wrong."""
        yield f"{self.verdict}: {self.unreadable}" if self.unreadable else self.verdict
        yield from (f"  {said}" for said in self.words)
        yield from (f"  {': '.join(failure)}" for failure in self.failures[:_SHOWN])
        if len(self.failures) > _SHOWN:
            yield f"  and {len(self.failures) - _SHOWN:,} more"

    def document(self) -> dict[str, Any]:
        """Return it as an object for JSON."""
        names = ("statement", "where", "problem")
        return {
            "verdict": self.verdict,
            "claims": self.words,
            "failures": [dict(zip(names, failure, strict=True)) for failure in self.failures],
            "unreadable": self.unreadable or None,
        }


def verify(document: object) -> Report:
    """Check a certificate, given as what ``json.loads`` makes of the file.

    Linear in the outcomes of enabled actions, in fractions; and what each rule's text takes.
    """
    try:
        certificate = check_document(document)
    except UnreadableError as error:
        return Report(unreadable=str(error))
    failures = find_false(certificate)
    return Report(failures, words=[] if failures else certificate["claims"]["words"])


def verify_text(text: str) -> Report:
    """Check a certificate that was read from a file.

    Examples
    --------
    >>> verify_text("{").unreadable
    'it is no JSON: Expecting property name enclosed in double quotes'
    """
    try:
        document = read_document(text)
    except UnreadableError as error:
        return Report(unreadable=str(error))
    return verify(document)


def main(arguments: Sequence[str]) -> int:
    """Check the file that is named, tell the verdict, and return the exit code."""
    paths = [argument for argument in arguments if argument != "--json"]
    if len(paths) != 1:
        sys.stderr.write("usage: python -m verifier FILE [--json]\n")
        return 2
    try:
        report = verify_text(Path(paths[0]).read_text(encoding="utf-8"))
    except OSError as error:
        report = Report(unreadable=f"cannot read {paths[0]}: {error.strerror}")
    except UnicodeDecodeError:
        report = Report(unreadable="it is no text in UTF-8")
    told = json.dumps(report.document(), indent=2) if "--json" in arguments else "\n".join(report.lines())
    sys.stdout.write(told + "\n")
    return report.exit_code
