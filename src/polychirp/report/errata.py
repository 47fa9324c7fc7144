"""Where the paper is wrong or silent, in a sentence or two; the documentation derives each."""

from __future__ import annotations

from typing import Final

ERRATA: Final[tuple[tuple[str, str], ...]] = (
    (
        "Range, equation 9",
        "The factor cT/4B halves every range unless T spans both ramps of the triangle. "
        "We use each ramp's own slope.",
    ),
    (
        "Speed, equation 10",
        "The wavelength must be that of the lowest frequency of an up-then-down triangle. The "
        "carrier's makes every speed 0.6 % wrong, 0.6 km/h at 100 km/h.",
    ),
    (
        "Threshold, equation 12",
        "A cell of noise exceeds its mean amplitude with probability e^(−π/4) = 45.6 %. We draw "
        "that threshold for comparison and detect with a constant false-alarm rate.",
    ),
    (
        "Suppression is not removal",
        "Diversity turns a ghost into a raised floor: the energy of a crossing chirp stays. What "
        "lies below that floor is masked, so ghosts, misses and floor rise are shown together.",
    ),
    (
        "The correlation experiment",
        "Auto-correlation at 4 GHz and cross-correlation against 3.75 GHz compare bands that do "
        "not meet: that is frequency division. We run it as printed and with overlapping bands, "
        "where the peak follows −10 log(|ΔB| T) + 1.4 dB.",
    ),
    (
        "Ghosts need luck",
        "A ghost needs equal slopes and starts within 0.2 µs of each other: one frame in 15 000 "
        "for two radars that start at random. The paper shows that worst case only; we show both.",
    ),
    (
        "An honest comparator",
        "One fixed slope per radar, different for each, suppresses as well as redrawing it at "
        "every sweep, as long as no two radars happen to draw the same one.",
    ),
    (
        "Doppler",
        "Ramps of 1–2 ms make a slow-time transform ambiguous every 0.5–1 m/s, and slopes that "
        "change make it invalid. We estimate range and speed jointly over all ramps.",
    ),
    (
        "Gains, table 2",
        "Gains of 36 and 42 dB contain antennas of 27 dBi; a beam of ±80° × ±10° has about 11. "
        "Levels here follow the table as printed; real ones lie 16 dB lower at each end.",
    ),
)
