r"""The production engine: beats in closed form after the radar's IF filter.

A ramp of slope :math:`b_i`, received with a delay τ that is linear in time, is a linear chirp. Its
beat with the victim's ramp of slope :math:`b_v` is a chirp of rate
:math:`\mu = b_v - b_i(1-\dot\tau)^2` while both last. A delay with the acceleration
:math:`\ddot\tau` adds its product with the received frequency to the rate; `slow_changes` adds
what is left of its effect, and that of the amplitude's drift.

If a sample's filter window lies within the beat, the sample is the beat's value times the filter's
response to a chirp (`chirp_response`). If the beat begins or ends in the window, the sample is an
integral over the common part, of the sum of all links (`near_corners`), or, where the beat is far
out of band at that end, an expansion there.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.model.if_frame import SampleTimes, sample_times
from polychirp.model.paths import PropagationPaths
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.spec import Spec
from polychirp.synthesis.links.leakage import all_links, num_parts
from polychirp.synthesis.links.links import nearest_snapshots
from polychirp.synthesis.links.thermal_noise import noise_density
from polychirp.synthesis.stretch.coded_ramps import add_coded, parts_of_pairs, sub_ramps
from polychirp.synthesis.stretch.kernel_records import (
    CodedRamps,
    LinkTable,
    Ramps,
    Tables,
    WindowSeries,
)
from polychirp.synthesis.stretch.kernel_tables import (
    link_table,
    pair_table,
    ramps_of,
    taps_of,
    window_of,
    with_limits,
)
from polychirp.synthesis.stretch.near_corners import near_runs, window_series
from polychirp.synthesis.stretch.nufft import MakeTones, tones_of
from polychirp.synthesis.stretch.path_batches import FEWEST_LINKS, batch_of, batched_samples
from polychirp.synthesis.stretch.ramp_edges import corner_runs
from polychirp.synthesis.stretch.ramp_overlaps import all_overlaps, strongest_sample
from polychirp.synthesis.stretch.slow_changes import slow_changes
from polychirp.synthesis.stretch.work_units import WorkUnit, gaps, work_table, work_units_of
from polychirp.threads import one_blas_thread

NEGLIGIBLE_IN_BAND: Final = 3e-7
"""Limit of the omitted part of a contribution, relative to the rms of its strongest samples.

Chosen. The rms is estimated from the in-band power of all paths of the strongest pair of ramps."""

NEGLIGIBLE_OUT_OF_BAND: Final = 1e-3
"""The same limit, relative to the victim's rms noise, if no path comes into the band; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch(Spec):
    """Closed-form synthesis at the converter's rate.

    Weak signals are left out, together up to 3e-7 of the strongest samples or, if no path comes
    into the band, 1e-3 of the victim's thermal noise. The rest is right to 1e-7 of the strongest.

    Parameters
    ----------
    backend : method of summing over paths. "auto" takes whichever costs less: compiled kernels
        path by path, or compiled Fourier transforms of batches of paths; "kernels" sums path by
        path only; "numpy" and "cupy" compute batches by matrix products of these array libraries
        where these take fewer operations than path by path
    """

    backend: Literal["auto", "kernels", "numpy", "cupy"] = "auto"

    @one_blas_thread()
    def contribution(
        self,
        scene: Scene,
        schedules: Sequence[RampSchedule],
        snapshots: Sequence[PropagationPaths],
        *,
        victim: int,
        transmitter: int,
    ) -> ComplexArray:
        """See `SynthesisEngine.contribution`."""
        radar = scene.radars[victim]
        own, sent = schedules[victim], schedules[transmitter]
        links = all_links(
            scene, snapshots, victim=victim, transmitter=transmitter, num_elements=sent.num_elements
        )
        times = sample_times(own, radar.converter)
        parts = num_parts(radar, is_own=victim == transmitter)
        shape = (parts, radar.array.num_channels, own.num_ramps, times.most_samples)
        samples = np.zeros(shape, dtype=np.complex128)
        table = link_table(links, nearest_snapshots(own, snapshots))
        ramps = ramps_of(own), ramps_of(sent)
        if sent.code is None:
            self._add_chirps(samples, radar, (own, sent), ramps, table, times)
            return samples
        window, taps = window_of(own, times), taps_of(radar.if_filter)
        coded = CodedRamps(*ramps, window, table, taps)
        left = add_coded(samples, radar, own, sent, coded, is_own=victim == transmitter)
        if left:
            plain, whole = sub_ramps(sent)
            split = ramps[0], ramps_of(plain)
            pairs = parts_of_pairs(left, whole)
            self._add_chirps(samples, radar, (own, plain), split, table, times, pairs)
        return samples

    def _add_chirps(
        self,
        samples: ComplexArray,
        radar: Radar,
        schedules: tuple[RampSchedule, RampSchedule],
        ramps: tuple[Ramps, Ramps],
        table: LinkTable,
        times: SampleTimes,
        pairs: Collection[tuple[int, int]] | None = None,
    ) -> None:
        """Add all links of a schedule without a code, or those of some pairs of ramps only."""
        own, sent = schedules
        overlaps = all_overlaps(radar, own, sent, ramps, table, pairs)
        if not overlaps:
            return
        strongest = strongest_sample(overlaps)
        floor = NEGLIGIBLE_IN_BAND * strongest
        if floor == 0.0:
            noise = noise_density(radar) * radar.if_filter.noise_bandwidth
            floor = NEGLIGIBLE_OUT_OF_BAND * math.sqrt(noise)
        table = with_limits(table, floor)
        window, taps = window_of(own, times), taps_of(radar.if_filter)
        units = work_units_of(radar.if_filter, ramps[0], window, table, taps, overlaps, floor)
        used = {unit.pair for unit in units}
        pair_tables = pair_table(radar.if_filter, overlaps, used)
        series = window_series(radar.if_filter, window.step)
        tables = Tables(*ramps, window, table, pair_tables, taps)
        self._add(samples, tables, series, units)
        for change in slow_changes(tables, strongest):
            some, least = change.tables.links, change.floor
            units = work_units_of(radar.if_filter, ramps[0], window, some, taps, overlaps, least)
            more = np.zeros_like(samples)
            self._add(more, change.tables, series, units)
            samples += change.factor * more

    def _add(
        self,
        samples: ComplexArray,
        tables: Tables,
        series: WindowSeries,
        units: Sequence[WorkUnit],
    ) -> None:
        """Add each unit as a batch or link by link, whichever costs less; corners by moments."""
        from polychirp.synthesis.stretch.near_corner_kernels import add_near_corners
        from polychirp.synthesis.stretch.path_kernels import add_contribution

        make_tones = tones_of(self.backend)
        rest, near = [], []
        for unit in units:
            far = float(tables.pairs.far[unit.pair])
            done = [] if self.backend == "kernels" else near_runs(unit, far)
            near += [(unit, run) for run in done]
            runs = self._runs(unit, tables, make_tones, done)
            if runs is not None:
                for run, made in runs:
                    samples[unit.part, :, unit.row, run] += made
                done += [unit.whole, *(run for run, _ in runs)]
            rest += gaps(unit, done)
        add_near_corners(samples, tables, work_table(near), series)
        add_contribution(samples, tables, work_table(rest))

    def _runs(
        self, unit: WorkUnit, tables: Tables, make_tones: MakeTones, near: Sequence[slice]
    ) -> list[tuple[slice, ComplexArray]] | None:
        """Runs of samples and their values, without those of ``near``; None if they cost more."""
        if self.backend == "kernels" or unit.num_links < FEWEST_LINKS:
            return None
        batch = batch_of(unit, tables)
        runs = batched_samples(unit, batch, make_tones)
        return None if runs is None else runs + corner_runs(unit, batch, near)
