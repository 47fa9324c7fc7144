"""A victim whose samples are so many that errors of phase can be multiplied onto them."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import SampleTimes, sample_times
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.units import from_db

TRANSITION_STOPBANDS: Final = 2.5
"""Width of the wide filter's transition band over the `stopband` of the victim's filter. Chosen:
the wide filter is then so short that its windows seldom contain ramps' ends."""

WIDE_FILTER_ATTENUATION: Final = from_db(120.0)
"""Attenuation of the wide filter, power ratio, which sets its ripple too; chosen."""


class _Early(Converter):
    """A converter whose window may begin before the ramp and end after it."""

    __slots__ = ()

    def __post_init__(self) -> None:
        pass


@dataclass(frozen=True, slots=True, kw_only=True)
class Wide:
    """A victim with so high a sample rate and so wide a filter that errors of phase can be added.

    The wide samples cover every window of the victim's own filter: sample n of the victim is at
    the wide sample ``reach + n·factor``.

    Parameters
    ----------
    radar : the victim
    own_times : when its converter samples
    scene : scene with a wide filter and a fast converter in the victim, without leakage and bumper
    highest_offset : Hz, up to which phase noise is computed as waves
    times : when the victim's converter in ``scene`` samples
    factor : number of wide samples per sample of the victim
    reach : number of wide samples in half the support of the victim's filter
    """

    radar: Radar
    own_times: SampleTimes
    scene: Scene
    highest_offset: float
    times: SampleTimes
    factor: int
    reach: int

    @classmethod
    def of(
        cls,
        scene: Scene,
        schedule: RampSchedule,
        victim: int,
        *,
        highest: float,
        excursion: float,
    ) -> "Wide":
        """The wide victim for noise with offsets up to ``highest`` Hz.

        Errors of the ramps shift beats by up to ``excursion`` Hz.
        """
        radar = scene.radars[victim]
        edge, converter = radar.if_filter.stopband, radar.converter
        shifted = highest + excursion + edge
        wide_filter = IfFilter(
            passband=shifted,
            stopband=shifted + TRANSITION_STOPBANDS * edge,
            attenuation=WIDE_FILTER_ATTENUATION,
        )
        # signals that the errors shift beyond half the rate must not fold back into the band
        most = wide_filter.stopband + shifted
        factor = math.ceil(most / converter.sample_rate)
        rate = factor * converter.sample_rate
        reach = math.ceil(0.5 * radar.if_filter.support * rate)
        early = _Early(
            sample_rate=rate,
            start=converter.start - reach / rate,
            margin=converter.margin - reach / rate,
        )
        wide = replace(radar, if_filter=wide_filter, converter=early, leakage=(), bumper=None)
        return cls(
            radar=radar,
            own_times=sample_times(schedule, converter),
            scene=_with_radar(scene, wide, victim),
            highest_offset=highest,
            times=sample_times(schedule, early),
            factor=factor,
            reach=reach,
        )

    def one_leakage_each(self, victim: int) -> Iterator[tuple[Scene, float]]:
        """Scenes with one of the victim's leakages, or its bumper, in each, and its delay, s.

        These delays are too short to share nodes: the noise that range correlation leaves is
        proportional to the delay.
        """
        wide, bumper = self.scene.radars[victim], self.radar.bumper
        for leak in self.radar.leakage:
            yield _with_radar(self.scene, replace(wide, leakage=(leak,)), victim), leak.delay
        if bumper is not None:
            delay = 2.0 * bumper.distance / SPEED_OF_LIGHT
            yield _with_radar(self.scene, replace(wide, bumper=bumper), victim), delay

    def narrowed(self, signal: ComplexArray) -> ComplexArray:
        """The ``signal`` after the victim's own filter, ``(…, ramp, fast)``, at its own times."""
        from scipy.signal import upfirdn

        rate = self.times.rate
        grid = np.arange(-self.reach, self.reach + 1) / rate
        taps = self.radar.if_filter.impulse_response(grid) / rate
        # zeros before the taps make the first whole window end on a sample that is kept
        late = -2 * self.reach % self.factor
        taps = np.concatenate([np.zeros(late), taps])
        skipped = (2 * self.reach + late) // self.factor
        kept = slice(skipped, skipped + self.own_times.most_samples)
        filtered = upfirdn(taps, signal, down=self.factor, axis=-1)[..., kept]
        return np.asarray(np.where(self.own_times.is_sample, filtered, 0.0))


def _with_radar(scene: Scene, radar: Radar, number: int) -> Scene:
    radars = list(scene.radars)
    radars[number] = radar
    return replace(scene, radars=tuple(radars))
