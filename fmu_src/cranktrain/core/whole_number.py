"""Whole numbers in texts of users: ASCII digits, at most 18, so that an int64 holds them.

``str.isdigit`` accepts superscripts, which ``int`` refuses, and ``int`` refuses more than 4300 digits.
"""

import re

_WHOLE = re.compile(r"[+-]?[0-9]{1,18}")


def whole_number(text: str) -> int | None:
    """Integer that a text states, with optional sign and spaces around it; None for any other text."""
    plain = text.strip()
    return int(plain) if _WHOLE.fullmatch(plain) else None
