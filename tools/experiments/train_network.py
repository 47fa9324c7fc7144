"""Trains the complex network of `polychirp.receiver.mitigation.complex_network`.

``python -m tools.experiments.train_network FILE`` writes the weights; on one core it takes
twelve minutes. Of all states that are tried on held-out frames, the one with the least loss
is kept.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any, Final

import numpy as np

from polychirp.receiver.mitigation.network_layers import Network
from polychirp.rng import Streams
from tools.experiments.network_examples import FRAMES, Examples, drawn_examples
from tools.experiments.network_gradient import Adam, loss_and_gradient

CHANNELS: Final = 12
"""Channels between the layers; chosen."""

STEPS: Final = 4000
"""Steps of Adam; chosen."""

BATCH: Final = 32
"""Pieces of a step; chosen."""

RATE: Final = 3e-3
"""Greatest rate of Adam, which falls to a hundredth as a half period of a cosine; chosen."""

EVERY: Final = 100
"""Steps from one loss on held-out frames to the next."""

TRAINED_ON: Final = (
    "frames of the families "
    + ", ".join(FRAMES)
    + " of polychirp's benchmark, set v2, from streams of their own"
)


def first_network(random: np.random.Generator, channels: int = CHANNELS) -> Network:
    """A network with drawn weights, whose layers keep mean powers."""

    def kernel(out: int, inputs: int) -> np.ndarray:
        shape, scale = (out, inputs, 9), (18.0 * inputs) ** -0.5
        draw = random.normal(size=shape) + 1j * random.normal(size=shape)
        return np.asarray(scale * draw, dtype=np.complex64)

    zeros = np.zeros(channels, dtype=np.float32)
    readout = 0.02 * random.normal(size=(1, channels, 9))
    return Network(
        (kernel(channels, 1), kernel(channels, channels), kernel(channels, channels)),
        (zeros, zeros),
        readout.astype(np.float32),
        np.array([2.0], dtype=np.float32),
    )


def trained_network(
    examples: Examples, held_out: Examples, *, steps: int = STEPS, rate: float = RATE
) -> Network:
    """The network with the least loss on the held-out examples."""
    random = Streams(0).of("network", "training")["weights and batches"]
    network = first_network(random)
    adam, best, least = Adam(network), network, np.inf
    for step in range(steps):
        chosen = random.integers(0, len(examples.planes), BATCH)
        loss, gradient = loss_and_gradient(network, *examples.some(chosen))
        now = rate * (0.505 + 0.495 * np.cos(np.pi * step / steps))
        network = adam.step(network, gradient, now)
        if (step + 1) % EVERY == 0 or step + 1 == steps:
            tried = np.mean(
                [
                    loss_and_gradient(network, *held_out.some(slice(n, n + BATCH)))[0]
                    for n in range(0, len(held_out.planes), BATCH)
                ]
            )
            print(f"step {step + 1}: loss {loss:.4f}, held-out {tried:.4f}", flush=True)
            if tried < least:
                best, least = network, float(tried)
    return best


def write_network(path: Path) -> None:
    """Train the network and store its weights."""
    start = time.perf_counter()
    examples, held_out = drawn_examples("training"), drawn_examples("selection", 0.1)
    print(f"{len(examples.planes)} pieces after {time.perf_counter() - start:.0f} s", flush=True)
    network = trained_network(examples, held_out)
    arrays: dict[str, Any] = {f"kernel_{n}": part for n, part in enumerate(network.kernels)}
    arrays |= {f"bias_{n}": part for n, part in enumerate(network.biases)}
    arrays |= {"readout": network.readout, "offset": network.offset}
    np.savez(path, trained_on=np.array(TRAINED_ON), **arrays)
    print(f"{network.num_weights} weights, {time.perf_counter() - start:.0f} s", flush=True)


if __name__ == "__main__":
    write_network(Path(sys.argv[1]))
