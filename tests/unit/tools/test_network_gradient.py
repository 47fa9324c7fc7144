"""The gradient of the complex network's loss, beside finite differences."""

import numpy as np
import pytest

from polychirp.receiver.mitigation.network_layers import Network, logits
from tools.experiments.network_gradient import Adam, loss_and_gradient, of_parts, parts_of


def drawn(random, *shape):
    return random.normal(size=shape) + 1j * random.normal(size=shape)


def network_of(random):
    kernels = (drawn(random, 3, 1, 9), 0.4 * drawn(random, 2, 3, 9), 0.4 * drawn(random, 2, 2, 9))
    biases = (random.normal(size=3), random.normal(size=2))
    return Network(kernels, biases, 0.1 * random.normal(size=(1, 2, 9)), np.array([0.3]))


def test_the_gradient_is_the_limit_of_finite_differences():
    """Every weight, its imaginary part too."""
    random = np.random.default_rng(3)
    network, planes = network_of(random), drawn(random, 2, 5, 7)
    kept, weight = random.random(planes.shape), random.random(planes.shape)

    def loss(parts):
        logit = logits(of_parts(parts), planes)
        entropy = np.logaddexp(0.0, logit) - kept * logit
        return float(np.sum(weight * entropy) / np.sum(weight))

    found, gradient = loss_and_gradient(network, planes, kept, weight)
    parts = parts_of(network)
    assert found == pytest.approx(loss(parts), rel=1e-12)
    for n, slope in enumerate(parts_of(gradient)):
        assert slope.shape == parts[n].shape
        for place in np.ndindex(slope.shape):
            for unit in (1.0, 1j) if np.iscomplexobj(parts[n]) else (1.0,):
                moved = [[part.copy() for part in parts] for _ in range(2)]
                moved[0][n][place] += 1e-6 * unit
                moved[1][n][place] -= 1e-6 * unit
                expected = (loss(moved[0]) - loss(moved[1])) / 2e-6
                value = slope[place].imag if unit == 1j else slope[place].real
                assert value == pytest.approx(expected, rel=1e-4, abs=1e-8)


def test_steps_of_adam_lower_the_loss():
    random = np.random.default_rng(4)
    network, planes = network_of(random), drawn(random, 2, 5, 7)
    kept, weight = (np.abs(planes) < 1.0).astype(float), np.ones(planes.shape)
    adam, losses = Adam(network), []
    for _ in range(60):
        loss, gradient = loss_and_gradient(network, planes, kept, weight)
        losses.append(loss)
        network = adam.step(network, gradient, 0.01)
    assert losses[-1] < 0.7 * losses[0]
