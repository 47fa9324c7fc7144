import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.receiver.angle.doa import (
    bartlett,
    capon,
    covariance,
    root_music,
    sines_of_sources,
)
from tests.support.references.receiver import sines_of_sources_twin


def waves(sines, *, num_elements: int, num_snapshots: int, seed: int = 1, spacing: float = 0.5):
    """Snapshots ``(detection, channel, snapshot)`` of sines ``(detection, source)``."""
    sines = np.asarray(sines, dtype=float)
    random = np.random.default_rng(seed)
    phase = np.exp(2j * np.pi * random.random((*sines.shape, num_snapshots)))
    place = np.arange(num_elements)[:, None]
    steering = np.exp(-2j * np.pi * spacing * place * sines[:, None, :])
    return steering @ phase


def noise(shape, *, power: float, seed: int = 2) -> np.ndarray:
    random = np.random.default_rng(seed)
    return np.sqrt(power / 2) * (random.normal(size=shape) + 1j * random.normal(size=shape))


@pytest.mark.parametrize("num_elements", [2, 4, 8, 16])
@pytest.mark.parametrize("spacing", [0.5, 0.4])
def test_one_source_without_noise_is_exact(num_elements: int, spacing: float):
    sines = np.linspace(-0.95, 0.95, 21)
    options = {"num_elements": num_elements, "num_snapshots": 1, "spacing": spacing}
    found = root_music(waves(sines[:, None], **options), spacing=spacing)
    np.testing.assert_allclose(found, sines, atol=1e-13)


@pytest.mark.parametrize("beamformer", [bartlett, capon])
@pytest.mark.parametrize("num_elements", [2, 4, 8])
@pytest.mark.parametrize("spacing", [0.5, 0.4])
def test_a_beamformers_maximum_is_the_one_source(beamformer, num_elements: int, spacing: float):
    sines = np.linspace(-0.95, 0.95, 21)
    options = {"num_elements": num_elements, "num_snapshots": 3, "spacing": spacing}
    found = beamformer(waves(sines[:, None], **options), spacing=spacing)
    np.testing.assert_allclose(found, sines, atol=1e-6)


def test_bartlett_is_as_good_as_one_source_allows_and_root_music_is_the_same():
    """var s = 1/(2 SNR L (2πd)² Σ(m − m̄)²), 3000 detections: 4 sigma are 5 %."""
    sines = np.random.default_rng(8).uniform(-0.8, 0.8, (3000, 1))
    clean = waves(sines, num_elements=4, num_snapshots=32)
    noisy = clean + noise(clean.shape, power=0.01)
    bound = 1.0 / np.sqrt(2 * 100 * 32 * np.pi**2 * 5.0)
    for method in (bartlett, root_music, capon):
        error = np.sqrt(np.mean((method(noisy, spacing=0.5) - sines[:, 0]) ** 2))
        assert error == pytest.approx(bound, rel=0.06)


def test_capon_separates_sources_that_bartlett_merges():
    """Two incoherent sources within a beam: Bartlett's maximum lies between, Capon's on one."""
    pair = waves([[0.0, 0.4]], num_elements=4, num_snapshots=400)
    pair = pair + noise(pair.shape, power=1e-4)
    apart = [np.min(np.abs(m(pair, spacing=0.5)[0] - [0.0, 0.4])) for m in (bartlett, capon)]
    assert apart[0] > 0.1
    assert apart[1] < 0.02


@pytest.mark.parametrize("beamformer", [bartlett, capon])
def test_a_beamformer_needs_a_spacing(beamformer):
    with pytest.raises(InputError, match="spacing"):
        beamformer(np.ones((1, 4, 1)), spacing=0.0)


@pytest.mark.parametrize("num_elements", [4, 8, 16])
def test_two_sources_without_noise_are_exact(num_elements: int):
    sines = np.array([[-0.3, 0.25], [0.5, 0.9], [-0.5, 0.5], [0.0, 0.5]])
    snapshots = waves(sines, num_elements=num_elements, num_snapshots=8)
    found = sines_of_sources(covariance(snapshots), num_sources=2, spacing=0.5)
    np.testing.assert_allclose(found, sines, atol=1e-11)


def test_two_coherent_sources_of_one_snapshot_are_separated_by_subarrays():
    sines = np.array([[-0.3, 0.25], [0.2, 0.7]])
    snapshots = waves(sines, num_elements=8, num_snapshots=1)
    found = sines_of_sources(covariance(snapshots, subarray=5), num_sources=2, spacing=0.5)
    np.testing.assert_allclose(found, sines, atol=1e-10)


@pytest.mark.parametrize(("num_elements", "num_sources"), [(4, 1), (4, 3), (8, 2), (16, 3)])
def test_the_batch_agrees_with_one_polynomial_after_the_other(num_elements, num_sources):
    """Rounding splits nearly double roots by the root of 1e-16 and the sources' closeness."""
    sines = np.random.default_rng(5).uniform(-0.9, 0.9, (50, num_sources))
    clean = waves(sines, num_elements=num_elements, num_snapshots=12)
    matrices = covariance(clean + noise(clean.shape, power=0.01))
    options = {"num_sources": num_sources, "spacing": 0.5}
    np.testing.assert_allclose(
        sines_of_sources(matrices, **options), sines_of_sources_twin(matrices, **options), atol=1e-6
    )


def test_a_covariance_is_the_same_seen_from_the_other_end():
    """R = J R* J for every forward–backward average, and it is Hermitian."""
    matrices = covariance(noise((3, 5, 4), power=1.0))
    np.testing.assert_allclose(matrices, matrices[:, ::-1, ::-1].conj())
    np.testing.assert_allclose(matrices, matrices.conj().swapaxes(1, 2))


def test_no_detections_have_no_azimuths():
    assert root_music(np.empty((0, 4, 16)), spacing=0.5).shape == (0,)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: covariance(np.ones((4, 2))), "detection, channel, snapshot"),
        (lambda: covariance(np.ones((1, 4, 2)), subarray=5), "between 2 and the array's 4"),
        (lambda: sines_of_sources(np.eye(4)[None], num_sources=4, spacing=0.5), "1 to 3 sources"),
        (lambda: sines_of_sources(np.eye(4)[None], num_sources=1, spacing=0.0), "positive"),
    ],
)
def test_impossible_arrays_and_sources_are_refused(call, message: str):
    with pytest.raises(InputError, match=message):
        call()
