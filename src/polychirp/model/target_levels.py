"""`TargetLevels`: echo and interference over noise in the cells of true targets."""

from dataclasses import dataclass

from polychirp.axes import FloatArray, PerTarget, Sealed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TargetLevels(Sealed):
    """Power ratios in the cell of each target, whether it is detected or not, ``(target,)``.

    Parameters
    ----------
    snr : own echo to noise
    inr : all parts of the samples but echo and noise, to noise
    """

    snr: PerTarget
    inr: PerTarget

    @property
    def sinr(self) -> FloatArray:
        """Ratio of the own echo to all other parts of the samples."""
        return self.snr / (1.0 + self.inr)
