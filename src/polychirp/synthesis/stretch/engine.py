r"""The production engine: beats in closed form, behind the true IF filter.

A transmitted ramp, received with a delay that is linear in time, is again a linear chirp; its
product with the victim's ramp is a chirp of rate :math:`\mu = b_v - b_i(1-\dot\tau)^2` that lasts
while both do. A sample whose filter window lies within it is the chirp's value times
`chirp_response`; a sample whose window is cut is integrated, or expanded at the cut where the beat
there is far out of band.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.model.if_frame import sample_times
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.spec import Spec
from polychirp.synthesis.links.leakage import all_links, num_parts
from polychirp.synthesis.links.links import nearest_snapshots
from polychirp.synthesis.links.thermal_noise import noise_density
from polychirp.synthesis.stretch.kernel_tables import (
    Tables,
    lines_of,
    pairs_of,
    ramps_of,
    taps_of,
    window_of,
    with_limits,
)
from polychirp.synthesis.stretch.nufft import tones_of
from polychirp.synthesis.stretch.path_batches import bundled
from polychirp.synthesis.stretch.ramp_edges import corner_runs
from polychirp.synthesis.stretch.ramp_overlaps import all_overlaps, strongest_sample
from polychirp.synthesis.stretch.work_units import Visit, columns_of, gaps, visits_of

NEGLIGIBLE: Final = 3e-7
"""What may be left out of a contribution, relative to the rms of what its paths bring into the band
where that is most, and so to about its strongest sample."""

INAUDIBLE: Final = 1e-3
"""The same, relative to the rms of the victim's noise, where nothing comes into the band."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch(Spec):
    """Closed-form synthesis at the converter's rate.

    What it leaves out is 3e-7 of the rms of what the paths bring into the band, or, where nothing
    comes into it, one thousandth of the victim's thermal noise; all else is right to 1e-8.

    Parameters
    ----------
    backend : what sums many paths. "auto" chooses, by what it costs, compiled kernels path by path
        or bundles of paths on compiled Fourier transforms; "kernels" is path by path alone;
        "numpy" and "cupy" are bundles by matrix products of these array libraries, wherever they
        cost less operations than path by path
    """

    backend: Literal["auto", "kernels", "numpy", "cupy"] = "auto"

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
            scene,
            snapshots,
            victim=victim,
            transmitter=transmitter,
            num_elements=sent.num_elements,
        )
        times = sample_times(own, radar.converter)
        parts = num_parts(radar, is_own=victim == transmitter)
        shape = (parts, radar.array.num_channels, own.num_ramps, times.most_samples)
        samples = np.zeros(shape, dtype=np.complex128)
        lines = lines_of(links, nearest_snapshots(own, snapshots))
        ramps = ramps_of(own), ramps_of(sent)
        overlaps = all_overlaps(radar, own, sent, ramps, lines)
        if overlaps:
            floor = NEGLIGIBLE * strongest_sample(overlaps)
            if floor == 0.0:
                noise = noise_density(radar) * radar.if_filter.noise_bandwidth
                floor = INAUDIBLE * math.sqrt(noise)
            lines = with_limits(lines, floor)
            window, taps = window_of(own, times), taps_of(radar.if_filter)
            visits = visits_of(radar.if_filter, ramps[0], window, lines, taps, overlaps, floor)
            visited = {visit.pair for visit in visits}
            pairs = pairs_of(radar.if_filter, own.num_ramps, overlaps, visited)
            tables = Tables(
                own=ramps[0], sent=ramps[1], window=window, lines=lines, pairs=pairs, taps=taps
            )
            self._add(samples, tables, visits)
        return samples

    def _add(self, samples: ComplexArray, tables: Tables, visits: Sequence[Visit]) -> None:
        """Add what the visits make: where it pays in bundles, the rest line by line."""
        from polychirp.synthesis.stretch import path_kernels

        make_tones = tones_of(self.backend)
        rest = []
        for visit in visits:
            runs = None if self.backend == "kernels" else bundled(visit, tables, make_tones)
            if runs is None:
                rest.append((visit, visit.met))
                continue
            runs += corner_runs(visit, tables)
            for run, made in runs:
                samples[visit.part, :, visit.row, run] += made
            rest += gaps(visit, [visit.whole, *(run for run, _ in runs)])
        path_kernels.add_contribution(
            samples, tables.own, tables.sent, tables.window, tables.lines, tables.pairs,
            tables.taps, columns_of(rest),
        )  # fmt: skip
