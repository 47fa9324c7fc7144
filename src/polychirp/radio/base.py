"""Interface of radios: a radio repeats a signal, records at the same time, and stops."""

import warnings
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from polychirp.errors import CapabilityError, InputError, ModelWarning
from polychirp.model.baseband import Baseband
from polychirp.radio.bands import band_warnings


@dataclass(frozen=True, slots=True, kw_only=True)
class Abilities:
    """Frequency and sample-rate limits of a radio.

    Parameters
    ----------
    name : name of the radio in messages
    lowest_carrier, highest_carrier : limits of the centre frequency, Hz
    highest_rate : greatest sample rate, 1/s
    radiates : true if it can transmit over the air, so that a licence may be needed
    """

    name: str
    lowest_carrier: float
    highest_carrier: float
    highest_rate: float
    radiates: bool = True


@runtime_checkable
class Radio(Protocol):
    """A radio that plays and records at the same time."""

    @property
    def abilities(self) -> Abilities:
        """Limits of the radio."""

    def play(self, signal: Baseband) -> None:
        """Begin to repeat ``signal``, whose magnitude is 1 at most, without gaps until `stop`."""

    def record(self, *, num_samples: int, sample_rate: float, centre_frequency: float) -> Baseband:
        """The next ``num_samples`` received samples; full scale is 1."""

    def stop(self) -> None:
        """Stop playing; do nothing if nothing is played."""


def measured(
    radio: Radio, signal: Baseband, *, repetitions: int = 2, i_hold_a_licence: bool = False
) -> Baseband:
    """Recording of a radio while it plays ``signal``, ``repetitions`` + 1 periods long.

    The recording begins anywhere within a period, so that it contains the whole signal
    ``repetitions`` times, 1 or more. The radio stops afterwards, also after an error.

    Parameters
    ----------
    i_hold_a_licence : states that you may transmit in the signal's band, or that a cable with an
        attenuator joins the radio's connectors; without it, no radio that radiates plays anything

    Raises
    ------
    InputError
        ``i_hold_a_licence`` is missing, a sample is above magnitude 1, or repetitions are below 1.
    CapabilityError
        The carrier or the sample rate is outside of the radio's limits.

    Warns
    -----
    ModelWarning
        The radio radiates: `band_warnings` about the signal's band.
    """
    check(radio.abilities, signal)
    if repetitions < 1:
        raise InputError(f"repetitions must be 1 or more, not {repetitions}")
    if radio.abilities.radiates:
        _ask(signal, i_hold_a_licence=i_hold_a_licence)
    try:
        radio.play(signal)
        return radio.record(
            num_samples=(repetitions + 1) * signal.num_samples,
            sample_rate=signal.sample_rate,
            centre_frequency=signal.centre_frequency,
        )
    finally:
        radio.stop()


def check(abilities: Abilities, signal: Baseband) -> None:
    """Refuse a signal that a radio cannot play."""
    if not (abilities.lowest_carrier <= signal.centre_frequency <= abilities.highest_carrier):
        raise CapabilityError(
            f"{abilities.name} tunes {abilities.lowest_carrier / 1e9:g} to "
            f"{abilities.highest_carrier / 1e9:g} GHz, not {signal.centre_frequency / 1e9:g} GHz; "
            "choose a carrier inside: correlations depend on bandwidth and time, not on carriers"
        )
    if signal.sample_rate > abilities.highest_rate * (1 + 1e-9):
        raise CapabilityError(
            f"{abilities.name} takes up to {abilities.highest_rate / 1e6:g} MS/s, not "
            f"{signal.sample_rate / 1e6:g} MS/s; use a signal of a lower rate and less bandwidth"
        )
    strongest = float(abs(signal.samples).max())
    if strongest > 1.0 + 1e-9:
        raise InputError(
            f"a sample to be played has magnitude {strongest:.3g}, above 1; scale the signal down"
        )


def _ask(signal: Baseband, *, i_hold_a_licence: bool) -> None:
    low = signal.centre_frequency - 0.5 * signal.sample_rate
    high = signal.centre_frequency + 0.5 * signal.sample_rate
    sentences = list(band_warnings(low, high))
    if not i_hold_a_licence:
        raise InputError(
            f"nothing was transmitted: {'; '.join(sentences)}; join the connectors by a cable with "
            "an attenuator, or hold a licence for this band; then repeat the command with "
            "--i-hold-a-licence"
        )
    for sentence in sentences:
        warnings.warn(f"transmitting: {sentence}", ModelWarning, stacklevel=3)
