"""When a recording was made, as the headers of motion files write it."""

from __future__ import annotations

import re
from datetime import datetime

_DATE = r"(?P<year>\d{4})[-/.](?P<month>\d{1,2})[-/.](?P<day>\d{1,2})"
_TIME = r"(?P<hour>\d{1,2})[:.](?P<minute>\d{2})[:.](?P<second>\d{2})(?:[.,](?P<part>\d{1,6})\d*)?"
_MOMENT = re.compile(rf"\s*{_DATE}[\sT,]+{_TIME}\s*(?P<half>[AaPp])?\.?(?(half)[Mm]\.?)\s*", re.ASCII)


def moment(text: str) -> datetime | None:
    """Of "2021-08-26, 15:19:24" (Qualisys) or "2017-02-14 04.30.26.264 PM" (Motive); None where it is no such time.

    No zone is written: it is taken as this computer's.
    """
    found = _MOMENT.fullmatch(text)
    if found is None:
        return None
    year, month, day, hour, minute, second = (
        int(found[name]) for name in ("year", "month", "day", "hour", "minute", "second")
    )
    if found["half"]:
        if not 1 <= hour <= 12:
            return None
        hour = hour % 12 + (12 if found["half"] in "Pp" else 0)
    microsecond = int((found["part"] or "").ljust(6, "0"))
    try:
        return datetime(year, month, day, hour, minute, second, microsecond).astimezone()
    except (OSError, OverflowError, ValueError):
        return None
