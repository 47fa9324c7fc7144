"""Nulling: an interferer's wavefront is removed from the samples that it hits."""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.errors import CapabilityError, InputError
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.mitigation.base import Mitigated, refuse_frame
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.units import Ratio, from_db

GOOD_PER_CHANNEL: Final = 4
"""Least number of good complex samples per channel; a real sample counts half. The covariance of
fewer is nearly singular, and noise alone seems to have directions of interference: at the default
``least_excess``, 1.6 of the 8 directions of as many good samples as channels. Chosen: with 2 to 16
channels at most 0.01 directions are then nulled falsely; at half of it up to 0.08, at twice of it
none in a thousand, and a ramp of long bursts is left as it is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Nulling(BurstRepair):
    r"""Remove the directions of interference, over the channels, from the samples that are hit.

    With the sample covariances over the channels :math:`R_h` of a ramp's hit samples and
    :math:`R_g` of its good ones, interference is where the eigenvalues of
    :math:`R_g^{-1/2} R_h R_g^{-1/2}` exceed ``least_excess``. With these eigenvectors V, the hit
    samples become

    .. math:: R_g^{1/2} (1 - V V^H) R_g^{-1/2}\,y,

    a null in each direction of interference that disturbs echoes and noise least: sample matrix
    inversion (Reed, Mallett and Brennan 1974) in the form of a projection, which keeps the channels
    (Rameez, Dahl and Pettersson 2018 form one beam instead). Each interferer takes one of the
    channels, and two of real samples; at least one channel is left.
    In the hit samples an echo loses its part in the direction of the interferer, so that an echo
    from there is gone, and the azimuths of others change a little. A ramp with fewer hit
    samples than channels, or with fewer good ones than `GOOD_PER_CHANNEL` times as many, is left as
    it is. It takes 8 C² real multiplications per hit sample of C
    channels. `Blanking` removes these samples from all directions.

    Parameters
    ----------
    least_excess : power ratio
    """

    kind: Literal["nulling"] = "nulling"
    least_excess: Ratio = from_db(10.0)

    def __post_init__(self) -> None:
        BurstRepair.__post_init__(self)
        if not self.least_excess > 1.0:
            raise InputError("the least excess of nulling must be above 0 dB")

    def refuse(
        self, schedule: RampSchedule, *, times: SampleTimes, is_real: bool, num_channels: int
    ) -> None:
        """Refuse an array that has no direction to spare.

        Raises
        ------
        CapabilityError
            There are fewer than two channels.
        """
        del schedule, times, is_real
        if num_channels < 2:
            raise CapabilityError(
                "the mitigation 'nulling' needs two receiving channels or more, and this radar has "
                f"{num_channels}; 'blanking' works with one"
            )

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples, those that are hit without the directions of interference."""
        refuse_frame(self, frame)
        hit, present = self.hit(frame), frame.times.is_sample
        least = GOOD_PER_CHANNEL * len(frame.samples)
        if not np.any(frame.samples.imag):
            least *= 2
        projections = []
        for k in np.flatnonzero(np.count_nonzero(hit, axis=1) >= len(frame.samples)):
            struck = np.flatnonzero(hit[k])
            good = frame.samples[:, k, present[k] & ~hit[k]]
            if good.shape[1] >= least:
                inside = frame.samples[:, k, struck]
                projections.append((int(k), struck, self._projection(inside, good)))

        def repair(samples: ComplexArray) -> ComplexArray:
            out = samples * present
            for k, struck, matrix in projections:
                out[..., k, struck] = matrix @ samples[..., k, struck]
            return np.asarray(out)

        weight = present.astype(np.float64)
        return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)

    def _projection(self, struck: ComplexArray, good: ComplexArray) -> ComplexArray:
        """Matrix ``(channel, channel)`` for samples ``(channel, place)``."""
        value, vector = np.linalg.eigh(good @ good.conj().T / good.shape[1])
        # echoes of one direction and no noise leave the others without power
        value = np.maximum(value, 1e-9 * value[-1] + 1e-300)
        root = (vector * np.sqrt(value)) @ vector.conj().T
        white = (vector / np.sqrt(value)) @ vector.conj().T
        excess, direction = np.linalg.eigh(white @ (struck @ struck.conj().T) @ white)
        excess = excess / struck.shape[1]
        lost = direction[:, 1:][:, excess[1:] > self.least_excess]
        return np.asarray(root @ (np.eye(len(root)) - lost @ lost.conj().T) @ white)
