"""Measures of front ends that only tests need."""

import math


def image_rejection(imbalance):
    r"""Power ratio \|α/β\|² of a beat to its image; infinite without an image."""
    straight, image = imbalance.weights
    return abs(straight) ** 2 / abs(image) ** 2 if image else math.inf
