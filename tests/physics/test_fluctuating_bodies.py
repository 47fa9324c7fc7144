"""A body whose scatterers fluctuate is detected where it is, and nowhere else."""

import numpy as np
import pytest

from polychirp.model.if_frame import IfFrame
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.coherent import new_points, search
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.points import HandPoint, frame_of

FAMILIES = {
    "equal": Triangular(bandwidth=1e9, ramp_duration=1e-3),
    "diverse": DiverseTriangular(),
}


def fluctuating(
    schedule: RampSchedule, *, distance: float, range_rate: float, seed: int
) -> IfFrame:
    """Four scatterers within 0.4 m, each with an amplitude that changes over the frame.

    Their gains are Gaussian processes of mean 1 and rms deviation 0.5, correlated over a tenth of
    the frame. The power of each is 5 dB above the noise of a sample, or up to 10 dB less.
    """
    draw = np.random.default_rng([61, seed])
    noise = frame_of(schedule, [], seed=seed)
    start = schedule.start_time
    late = (start[:, None] - start) / (0.1 * start[-1])
    root = np.linalg.cholesky(np.exp(-0.5 * late**2) + 1e-6 * np.eye(start.size))
    samples = noise.samples
    for number in range(4):
        scatterer = HandPoint(
            range=distance + draw.uniform(-0.2, 0.2),
            range_rate=range_rate,
            azimuth=0.1 + draw.uniform(-0.01, 0.01),
            power=3.0 * 10.0 ** draw.uniform(-1.0, 0.0),
        )
        change = root @ (draw.normal(size=(start.size, 2)) @ [1.0, 1j]) / np.sqrt(2.0)
        alone = frame_of(schedule, [scatterer], noise=0.0, seed=seed + 1000 * number)
        samples = samples + alone.samples * (1.0 + 0.5 * change)[:, None]
    return noise.with_samples(samples)


def detected(family: str, seed: int) -> tuple[int, int]:
    """Number of detections within 0.4 m and 1 m/s of the body, and of the others."""
    draw = np.random.default_rng([62, seed])
    distance, rate = draw.uniform(6.0, 20.0), draw.uniform(-15.0, 15.0)
    schedule = FAMILIES[family].schedule(num_sweeps=16, streams=Streams(seed))
    frame = fluctuating(schedule, distance=distance, range_rate=rate, seed=seed)
    found = CoherentReceiver().detect(frame)
    middle = 0.5 * (schedule.end_time.max() - schedule.start_time.min())
    near = np.abs(found.range - distance - rate * middle) < 0.4
    near &= np.abs(found.range_rate - rate) < 1.0
    return int(near.sum()), int((~near).sum())


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_a_fluctuating_body_is_found_and_causes_nothing_beside_it(family):
    """Three drawn frames; without residues there are 6 to 19 detections elsewhere in each."""
    counts = [detected(family, seed) for seed in range(3)]
    assert all(near > 0 for near, _ in counts)
    assert sum(away for _, away in counts) <= 1


@pytest.mark.slow
def test_without_residues_a_fluctuating_body_is_detected_at_other_places(monkeypatch):
    for module in (search, new_points):
        monkeypatch.setattr(module, "with_residues", lambda _, points, _others, **_how: points)
    assert detected("equal", 0)[1] >= 3
