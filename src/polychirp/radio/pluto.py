"""Adapter to radios of Analog Devices (ADALM-Pluto and similar ones) by pyadi-iio.

It needs ``pip install pyadi-iio 'pylibiio<1'``, and libiio 0.2x of the operating system. A Pluto
has 12-bit converters and takes up to 61.44 MS/s, but streams only a few MS/s over USB; therefore a
recording is one buffer. The adapter is tested without hardware, with a stand-in of pyadi-iio's
interface; it has not been tested with a radio.
"""

from importlib import import_module
from typing import Any, Final

import numpy as np

from polychirp.errors import CapabilityError
from polychirp.model.baseband import Baseband
from polychirp.radio.base import Abilities

SENT_SCALE: Final = 2.0**14
"""Integer for amplitude 1 in samples to pyadi-iio: 6 dB (chosen) below the full scale of 16 bits,
of which the converter uses the upper 12."""

READ_SCALE: Final = 2.0**11
"""Integer from pyadi-iio that becomes amplitude 1: full scale of 12 bits with their sign."""

STALE_BUFFERS: Final = 4
"""Number of received buffers that are discarded, because they may have been filled before the
carrier was tuned (chosen)."""


class PlutoRadio:
    """A Pluto at an address.

    Parameters
    ----------
    address : libiio's name of the connection, such as ``"ip:192.168.2.1"`` or ``"usb:"``
    transmit_gain : dB, at most 0; −30 by default, because two Plutos on a bench are close together
    receive_gain : dB
    module : module that replaces pyadi-iio in tests

    Raises
    ------
    CapabilityError
        pyadi-iio is not installed, or no radio answers at the address.
    """

    def __init__(
        self,
        address: str = "ip:192.168.2.1",
        *,
        transmit_gain: float = -30.0,
        receive_gain: float = 30.0,
        module: Any = None,
    ) -> None:
        adi = module if module is not None else _module()
        self._address = address
        self._played_rate: float | None = None
        try:
            self._device = adi.Pluto(address)
        except Exception as error:
            # pyadi-iio raises plain exceptions of its own and of libiio
            raise CapabilityError(
                f"no radio answers at '{address}' ({error}); 'iio_info -s' lists those that do"
            ) from None
        self._device.gain_control_mode_chan0 = "manual"
        self._device.rx_hardwaregain_chan0 = receive_gain
        self._device.tx_hardwaregain_chan0 = transmit_gain

    @property
    def abilities(self) -> Abilities:
        """See `Radio.abilities`; the limits are those of a Pluto as it is sold."""
        return Abilities(
            name=f"Pluto at '{self._address}'",
            lowest_carrier=325e6,
            highest_carrier=3.8e9,
            highest_rate=61.44e6,
        )

    def play(self, signal: Baseband) -> None:
        """See `Radio.play`; the radio itself repeats its buffer."""
        self.stop()
        device = self._device
        self._set_rate(signal.sample_rate)
        device.tx_lo = round(signal.centre_frequency)
        device.tx_rf_bandwidth = round(signal.sample_rate)
        device.tx_cyclic_buffer = True
        device.tx(signal.samples.astype(np.complex64) * np.float32(SENT_SCALE))
        self._played_rate = signal.sample_rate

    def record(self, *, num_samples: int, sample_rate: float, centre_frequency: float) -> Baseband:
        """See `Radio.record`.

        A Pluto has one sample rate for both directions. `CapabilityError` is raised if it plays at
        another rate than the recording's, or works at another rate than the requested one.
        """
        device = self._device
        if self._played_rate is None:
            self._set_rate(sample_rate)
        elif round(self._played_rate) != round(sample_rate):
            raise CapabilityError(
                f"a Pluto that plays at {self._played_rate / 1e6:g} MS/s cannot record at "
                f"{sample_rate / 1e6:g} MS/s, because it has one rate for both; record at the rate "
                "of the signal, or stop it first"
            )
        device.rx_lo = round(centre_frequency)
        device.rx_rf_bandwidth = round(sample_rate)
        device.rx_destroy_buffer()
        device.rx_buffer_size = num_samples
        for _ in range(STALE_BUFFERS):
            device.rx()
        return Baseband(
            samples=np.asarray(device.rx(), dtype=np.complex128) / READ_SCALE,
            sample_rate=sample_rate,
            centre_frequency=centre_frequency,
        )

    def stop(self) -> None:
        """See `Radio.stop`."""
        self._device.tx_destroy_buffer()
        self._played_rate = None

    def _set_rate(self, rate: float) -> None:
        self._device.sample_rate = round(rate)
        actual = float(self._device.sample_rate)
        if abs(actual - round(rate)) > 1e-6 * rate:
            raise CapabilityError(
                f"the radio works at {actual / 1e6:g} MS/s, not at the requested {rate / 1e6:g} "
                "MS/s; choose a rate that it supports"
            )


def _module() -> Any:
    try:
        return import_module("adi")
    except ImportError:
        raise CapabilityError(
            "pyadi-iio is not installed; install it with: pip install pyadi-iio 'pylibiio<1', and "
            "libiio with the operating system; or use --radio loopback"
        ) from None
