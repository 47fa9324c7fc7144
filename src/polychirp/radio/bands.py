"""Services that use radio bands, for warnings before a transmission; they are no legal advice."""

from collections.abc import Iterator
from typing import Final

SERVICE_BANDS: Final = (
    (108e6, 137e6, "aeronautical navigation and radio, on which lives depend"),
    (328.6e6, 335.4e6, "instrument landing, on which lives depend"),
    (694e6, 960e6, "mobile networks"),
    (960e6, 1215e6, "aeronautical navigation, on which lives depend"),
    (1164e6, 1300e6, "satellite navigation"),
    (1400e6, 1427e6, "passive: radio astronomy, all emissions are prohibited"),
    (1559e6, 1610e6, "satellite navigation"),
    (1710e6, 2170e6, "mobile networks"),
    (2496e6, 2690e6, "mobile networks"),
    (2700e6, 2900e6, "airport radars, on which lives depend"),
    (3300e6, 4200e6, "mobile networks and satellite downlinks"),
    (4200e6, 4400e6, "radio altimeters of aircraft, on which lives depend"),
    (76e9, 81e9, "automotive radar, for type-approved radars only"),
)
"""Lowest and highest frequency of a band, Hz, and the service that uses it in most countries (ITU
Radio Regulations)."""

LICENCE_FREE_BANDS: Final = ((433.05e6, 434.79e6), (2400e6, 2483.5e6), (5725e6, 5875e6))
"""Edges of bands for industry, science and medicine, Hz, in which low power needs no licence."""


def band_warnings(low: float, high: float) -> Iterator[str]:
    """Sentences, at least one, about the services that use the band from ``low`` to ``high`` Hz.

    >>> list(band_warnings(3.95e9, 4.05e9))
    ['3.95 to 4.05 GHz is used by mobile networks and satellite downlinks']
    >>> list(band_warnings(2.41e9, 2.43e9))
    ['2.41 to 2.43 GHz may be used without a licence at low power in most countries; look up the
    limit']
    >>> list(band_warnings(5e9, 5.1e9))
    ['5 to 5.1 GHz needs a licence nearly everywhere']
    """
    name = f"{low / 1e9:g} to {high / 1e9:g} GHz"
    users = [who for first, last, who in SERVICE_BANDS if low < last and high > first]
    for who in users:
        yield f"{name} is used by {who}"
    if any(first <= low and high <= last for first, last in LICENCE_FREE_BANDS):
        yield (
            f"{name} may be used without a licence at low power in most countries; look up the "
            "limit"
        )
    elif not users:
        yield f"{name} needs a licence nearly everywhere"
