"""Radio without hardware: a function of the played samples is received."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from polychirp.errors import InputError, RunError
from polychirp.model.baseband import Baseband
from polychirp.radio.base import Abilities
from polychirp.rng import Streams

Channel = Callable[[Baseband], Baseband]
"""Function from the played to the received signal, at the same sample rate."""


def ideal_cable(signal: Baseband) -> Baseband:
    """The signal itself, as through a cable without loss."""
    return signal


@dataclass(slots=True, kw_only=True)
class LoopbackRadio:
    """A radio that receives its own signal, from a random instant on, quantised to 16 bits.

    Parameters
    ----------
    channel : function from the played to the received signal
    seed : seed of the instant at which a recording begins
    abilities : limits of the radio that the loop-back replaces
    full_scale : V, magnitude of I or Q that becomes 1 in a recording; by default 3 dB above the
        strongest I or Q of each recording

    Raises
    ------
    InputError
        The full scale is not positive.
    """

    channel: Channel = ideal_cable
    seed: int = 1
    abilities: Abilities = field(
        default_factory=lambda: Abilities(
            name="the loop-back radio",
            lowest_carrier=0.0,
            highest_carrier=100e9,
            highest_rate=10e9,
            radiates=False,
        )
    )
    full_scale: float | None = None
    _signal: Baseband | None = None

    def __post_init__(self) -> None:
        if self.full_scale is not None and not self.full_scale > 0:
            raise InputError(
                f"a full scale of {self.full_scale:g} V is not positive; leave it out to have it "
                "chosen for each recording"
            )

    def play(self, signal: Baseband) -> None:
        """See `Radio.play`."""
        self._signal = signal

    def record(self, *, num_samples: int, sample_rate: float, centre_frequency: float) -> Baseband:
        """See `Radio.record`."""
        signal = self._signal
        if signal is None:
            raise RunError(
                "the loop-back radio plays nothing, so there is nothing to record; play a "
                "signal first"
            )
        period = signal.num_samples
        begin = int(Streams(self.seed)["loop-back", "begin"].integers(period))
        ratio = sample_rate / signal.sample_rate
        count = -(-(begin + math.ceil(num_samples / ratio)) // period) + 1
        received = self._received(signal, count)
        late = received.start_time + 0.5 * received.duration - 0.5 * count * signal.duration
        # what was played before the recording began is still on its way through the channel
        earlier = math.ceil(round(late * signal.sample_rate - begin, 3) / period)
        if earlier > 0:
            received = self._received(signal, count + earlier)
            begin += earlier * period
        received = received.retuned(centre_frequency).resampled(sample_rate)
        first = round(begin * ratio) - round(received.start_time * sample_rate)
        piece = received.samples[first : first + num_samples]
        return Baseband(
            samples=self._integers(piece),
            sample_rate=sample_rate,
            centre_frequency=centre_frequency,
        )

    def stop(self) -> None:
        """See `Radio.stop`."""
        self._signal = None

    def _received(self, signal: Baseband, count: int) -> Baseband:
        """The signal behind the channel, played ``count`` times from the time 0 on."""
        played = replace(signal, samples=np.tile(signal.samples, count), start_time=0.0)
        return self.channel(played)

    def _integers(self, samples: np.ndarray) -> np.ndarray:
        words = samples.view(np.float64)
        full = self.full_scale
        if full is None:
            full = float(np.sqrt(2.0) * np.abs(words).max()) or 1.0
        read = np.clip(np.rint(words / full * 2.0**15), -(2.0**15), 2.0**15 - 1) / 2.0**15
        return np.asarray(read.view(np.complex128))
