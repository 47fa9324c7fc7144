"""Ramp minimum: each range cell has its least amplitude over the ramps, on every ramp."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.errors import CapabilityError
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.mitigation.base import Mitigated, refuse_frame
from polychirp.receiver.mitigation.prediction import rms
from polychirp.receiver.signal_model.equal_ramps import unequal
from polychirp.spec import Spec


@dataclass(frozen=True, slots=True, kw_only=True)
class RampMinimum(Spec):
    r"""Scale each range cell of each ramp to its least amplitude over all ramps; keep its phase.

    .. math:: S_k \leftarrow S_k \frac{\min_l |S_l|}{|S_k|}

    with the spectrum :math:`S_k` of ramp k (Wagner, Sulejmani, Melzer, Meissner and Huemer 2018).
    Echoes are as strong on every ramp, and bursts are not, so that nothing needs to be detected.
    Amplitudes are root mean powers over the channels, and channels share the factor. The factors
    are transformed back, so that later stages receive samples.

    Its harm is sure, not possible: the least of M amplitudes of noise is below their mean on clean
    frames too, by 10 log₁₀ M dB of power for one channel. SINR therefore looks better than it is,
    and echoes near the noise lose amplitude. Two echoes in one range cell with different range
    rates beat from ramp to ramp, and the least of the beat is taken. Every sample of every frame
    changes.

    It makes detections where nothing is, on clean frames too: the factors follow the noise and the
    beats of echoes, so that they differ from ramp to ramp and modulate the echoes. Of 40 drawn
    frames of five points in noise, 30 had such detections, 2.3 in a frame, and none without it; of
    40 frames of a single point 10 had some (the test of the ramp minimum
    ``makes_detections_where_nothing_is`` in ``tests/conformance/test_mitigations.py``).

    Elements that transmit at once with codes of phases (`DopplerDivision`, `PhaseCoded`) beat in
    the same way: three points before an array of three by four elements had 4, 7 and 9 such
    detections in a frame with three bands, four bands and phase codes, and 3 with elements in turn,
    in four frames of each.

    `Imat` is the better choice if amplitudes matter. It takes 8 log₂ N + 4 real
    multiplications per sample and channel.
    """

    kind: Literal["ramp-minimum"] = "ramp-minimum"

    def refuse(
        self, schedule: RampSchedule, *, times: SampleTimes, is_real: bool, num_channels: int
    ) -> None:
        """Refuse ramps that it cannot repair.

        Raises
        ------
        CapabilityError
            The ramps are not equal, so that their range cells cannot be compared.
        """
        del times, is_real, num_channels
        if reason := unequal(schedule):
            raise CapabilityError(
                "the mitigation 'ramp-minimum' compares range cells of equal ramps, and of this "
                f"schedule {reason}; 'blanking' and 'stft-excision' work on any ramps"
            )

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples with the least amplitudes of all ramps."""
        from scipy import fft

        refuse_frame(self, frame)
        amplitude = rms(fft.fft(frame.samples, axis=-1))
        gain = amplitude.min(axis=0) / np.maximum(amplitude, 1e-300)

        def repair(samples: ComplexArray) -> ComplexArray:
            return np.asarray(fft.ifft(gain * fft.fft(samples, axis=-1), axis=-1))

        weight = frame.times.is_sample.astype(np.float64)
        return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)
