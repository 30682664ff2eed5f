"""Output on terminals and in files whose encoding lacks some characters."""

from __future__ import annotations

import codecs
import sys
import unicodedata

_REPLACEMENTS = {
    "°": "deg",
    "µ": "u",
    "²": "^2",
    "³": "^3",
    "×": "x",
    "·": "*",
    "±": "+-",
    "−": "-",
    "–": "-",
    "—": "-",
    "≤": "<=",
    "≥": ">=",
    "≈": "~",
    "→": "->",
    "…": "...",
    "√": "sqrt",
    "∞": "inf",
}
_ERRORS = "railenv.readable"


def replace_what_cannot_be_shown() -> None:
    """Let standard output and error replace characters that their encoding lacks, without failing."""
    codecs.register_error(_ERRORS, _replacement)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # replacements by tests and notebooks lack it
            stream.reconfigure(errors=_ERRORS)


def _replacement(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    return "".join(_plain(character, error.encoding) for character in text), error.end


def _plain(character: str, encoding: str) -> str:
    """Return the replacement of a character in an encoding that lacks it."""
    # α becomes alpha, é becomes e
    name = unicodedata.name(character, "")
    letter = name.removeprefix("GREEK SMALL LETTER ").removeprefix("GREEK CAPITAL LETTER ")
    if character in _REPLACEMENTS:
        plain = _REPLACEMENTS[character]
    elif letter != name:
        plain = letter.lower()
    else:
        plain = unicodedata.normalize("NFKD", character)
    return plain.encode(encoding, errors="ignore").decode(encoding) or "?"
