"""Checking a certificate by definition, with exact arithmetic and nothing but Python's standard library.

The heart is ``statements``: a certificate is valid if ten statements hold.  ``certificate`` says where an
outcome leads; ``comparison`` whether an automaton is that of its text, whose meaning ``patterns``,
``expressions`` and ``formulas`` know.  Nothing here imports supremal, so that the folder runs wherever Python
is: ``python path/to/verifier FILE``.  ``docs/certificate.md`` describes the format.

Source: McConnell, Mehlhorn, Näher, Schweitzer, "Certifying algorithms", Computer Science Review 5 (2011).
"""

from .comparison import find_difference
from .reading import FORMAT, VERSION, digest
from .report import Report, main, verify, verify_text
from .statements import STATEMENTS, claims_in_words
from .texts import TooLargeError

__all__ = [
    "FORMAT",
    "STATEMENTS",
    "VERSION",
    "Report",
    "TooLargeError",
    "claims_in_words",
    "digest",
    "find_difference",
    "main",
    "verify",
    "verify_text",
]
