"""Whole numbers in texts of users: digits of ASCII, and no more of them than an array of integers holds.

``str.isdigit`` takes superscripts, which ``int`` refuses, and ``int`` refuses more than 4300 digits.
"""

from __future__ import annotations

import re

_WHOLE = re.compile(r"[+-]?[0-9]{1,18}")


def whole_number(text: str) -> int | None:
    """The number that a text is, with spaces around it or a sign; None for any other text."""
    plain = text.strip()
    return int(plain) if _WHOLE.fullmatch(plain) else None
