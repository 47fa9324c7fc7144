"""Adapter to the radios for which SoapySDR has drivers.

SoapySDR is not on the Python package index. It comes with the operating system (Debian:
``python3-soapysdr`` and a module for the radio), so the virtual environment needs
``--system-site-packages``. The adapter is tested without hardware, with a stand-in of SoapySDR's
interface; it has not been tested with a radio.
"""

import threading
from importlib import import_module
from typing import Any, Final

import numpy as np

from polychirp.errors import CapabilityError, RunError
from polychirp.model.baseband import Baseband
from polychirp.radio.base import Abilities

DRIVER_TIMEOUT: Final = 1_000_000
"""Time limit of one call of the driver, µs: 1 s (chosen)."""

MOST_EMPTY_REPLIES: Final = 10
"""Greatest number of successive replies without samples; one more ends a transfer (chosen)."""

SETTLING_TIME: Final = 0.05
"""First part of a reception, s, that is discarded while tuning and gain settle (chosen)."""


class SoapyRadio:
    """One device of SoapySDR, of which the first transmitting and receiving channels are used.

    Parameters
    ----------
    arguments : SoapySDR's choice of the device, such as ``"driver=lime"``
    transmit_gain, receive_gain : dB, on the driver's own scale; None for the driver's default
    module : module that replaces SoapySDR in tests

    Raises
    ------
    CapabilityError
        SoapySDR is not installed, no device answers, or the device cannot transmit.
    """

    def __init__(
        self,
        arguments: str = "",
        *,
        transmit_gain: float | None = None,
        receive_gain: float | None = None,
        module: Any = None,
    ) -> None:
        self._soapy = module if module is not None else _module()
        try:
            self._device = self._soapy.Device(arguments)
        except RuntimeError as error:
            raise CapabilityError(
                f"SoapySDR finds no device '{arguments}' ({error}); 'SoapySDRUtil --find' lists "
                "those that answer"
            ) from None
        self._arguments = arguments
        self._gains = {"tx": transmit_gain, "rx": receive_gain}
        self._player: threading.Thread | None = None
        self._stopping = threading.Event()
        self._failure: str | None = None
        if not self._device.getNumChannels(self._soapy.SOAPY_SDR_TX):
            raise CapabilityError(f"the device '{arguments}' cannot transmit; choose another")

    @property
    def abilities(self) -> Abilities:
        """See `Radio.abilities`; the driver states the limits of the transmitter."""
        sends = self._soapy.SOAPY_SDR_TX
        carriers = self._device.getFrequencyRange(sends, 0)
        rates = self._device.getSampleRateRange(sends, 0)
        return Abilities(
            name=f"SoapySDR '{self._arguments}'",
            lowest_carrier=min(float(one.minimum()) for one in carriers),
            highest_carrier=max(float(one.maximum()) for one in carriers),
            highest_rate=max(float(one.maximum()) for one in rates),
        )

    def play(self, signal: Baseband) -> None:
        """See `Radio.play`; a thread writes the samples to the driver."""
        self.stop()
        stream = self._stream("tx", signal.sample_rate, signal.centre_frequency)
        samples = signal.samples.astype(np.complex64)
        self._stopping.clear()
        self._failure = None
        self._player = threading.Thread(target=self._feed, args=(stream, samples), daemon=True)
        self._player.start()

    def record(self, *, num_samples: int, sample_rate: float, centre_frequency: float) -> Baseband:
        """See `Radio.record`.

        `RunError` is raised if the driver lost samples or gives none, or the transmitter has
        stopped.
        """
        stream = self._stream("rx", sample_rate, centre_frequency)
        try:
            self._read(stream, int(SETTLING_TIME * sample_rate))
            samples = self._read(stream, num_samples)
        finally:
            self._close(stream)
        if self._failure is not None:
            raise RunError(f"the transmitter stopped: {self._failure}")
        return Baseband(
            samples=samples.astype(np.complex128),
            sample_rate=sample_rate,
            centre_frequency=centre_frequency,
        )

    def stop(self) -> None:
        """See `Radio.stop`."""
        if self._player is None:
            return
        self._stopping.set()
        self._player.join()
        self._player = None

    def _stream(self, which: str, rate: float, frequency: float) -> Any:
        soapy = self._soapy
        direction = soapy.SOAPY_SDR_TX if which == "tx" else soapy.SOAPY_SDR_RX
        self._device.setSampleRate(direction, 0, rate)
        self._device.setFrequency(direction, 0, frequency)
        gain = self._gains[which]
        if gain is not None:
            self._device.setGain(direction, 0, gain)
        actual = float(self._device.getSampleRate(direction, 0))
        if abs(actual - rate) > 1e-6 * rate:
            raise CapabilityError(
                f"the radio works at {actual / 1e6:g} MS/s, not at the requested {rate / 1e6:g} "
                "MS/s; choose a rate that it supports"
            )
        stream = self._device.setupStream(direction, soapy.SOAPY_SDR_CF32, [0])
        self._device.activateStream(stream)
        return stream

    def _close(self, stream: Any) -> None:
        self._device.deactivateStream(stream)
        self._device.closeStream(stream)

    def _feed(self, stream: Any, samples: np.ndarray) -> None:
        """Write the signal repeatedly, from the first sample that the driver did not take yet."""
        place, refusals = 0, 0
        while not self._stopping.is_set():
            rest = samples[place:]
            answer = self._device.writeStream(stream, [rest], rest.size, timeoutUs=DRIVER_TIMEOUT)
            if answer.ret > 0:
                place, refusals = (place + answer.ret) % samples.size, 0
            else:
                refusals += 1
            if refusals > MOST_EMPTY_REPLIES:
                self._failure = f"the driver answers {answer.ret}"
                break
        self._close(stream)

    def _read(self, stream: Any, count: int) -> np.ndarray:
        out = np.zeros(count, dtype=np.complex64)
        place, refusals = 0, 0
        while place < count:
            answer = self._device.readStream(
                stream, [out[place:]], count - place, timeoutUs=DRIVER_TIMEOUT
            )
            if answer.ret == self._soapy.SOAPY_SDR_OVERFLOW:
                raise RunError(
                    "the radio lost samples, because this computer was too slow; lower the sample "
                    "rate or close other programs"
                )
            if answer.ret > 0:
                place, refusals = place + answer.ret, 0
            else:
                refusals += 1
            if refusals > MOST_EMPTY_REPLIES:
                raise RunError(f"the radio gives no samples (the driver answers {answer.ret})")
        return out


def _module() -> Any:
    try:
        return import_module("SoapySDR")
    except ImportError:
        raise CapabilityError(
            "SoapySDR is not installed; install it with the operating system (Debian: "
            "python3-soapysdr and a module for the radio), in an environment made with "
            "--system-site-packages, or use --radio loopback"
        ) from None
