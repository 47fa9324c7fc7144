"""Errors and omissions of the paper in a few sentences; docs/explanation/errata.md derives them."""

from typing import Final

ERRATA: Final[tuple[tuple[str, str], ...]] = (
    (
        "Range, equation 9",
        "The factor cT/4B halves every range unless T spans both ramps of the triangle. "
        "We use each ramp's own slope.",
    ),
    (
        "Speed, equation 10",
        "The wavelength must be that of the lowest frequency of an up-then-down triangle. With the "
        "carrier's wavelength every speed is 0.6 % wrong, 0.6 km/h at 100 km/h.",
    ),
    (
        "Threshold, equation 12",
        "Noise in a cell exceeds its mean amplitude with probability e^(−π/4) = 45.6 %. We draw "
        "that threshold for comparison and detect with a constant false-alarm rate.",
    ),
    (
        "Suppression is not removal",
        "Diversity spreads a ghost over the floor: the energy of a crossing chirp remains. Echoes "
        "below that floor are masked, so ghosts, misses and floor rise are shown together.",
    ),
    (
        "The correlation experiment",
        "Auto-correlation at 4 GHz and cross-correlation with 3.75 GHz compare bands that do not "
        "overlap: that is frequency division. We run it as printed and with overlapping bands, "
        "where the peak follows −10 log(|ΔB| T) + 1.4 dB.",
    ),
    (
        "Ghosts are rare",
        "A ghost needs equal slopes and starts within 0.2 µs of each other: for two radars that "
        "start at random, in one frame of 15 000. The paper shows this worst case only; we show "
        "both cases.",
    ),
    (
        "A simpler alternative",
        "A fixed slope for each radar suppresses ghosts as well as a slope drawn for every sweep, "
        "as long as no two radars have the same slope.",
    ),
    (
        "Doppler",
        "With ramps of 1–2 ms a slow-time transform is ambiguous every 0.5–1 m/s, and with slopes "
        "that change it is invalid. We estimate range and speed jointly over all ramps.",
    ),
    (
        "Gains, table 2",
        "Gains of 36 and 42 dB include antennas of 27 dBi; a beam of ±80° × ±10° has about 11 dBi. "
        "Levels here follow the table as printed; real ones are 16 dB lower at each end.",
    ),
)
