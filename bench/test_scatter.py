"""Speed of corners, rough plates and crowns on the paper's street, of the second snapshot on."""

import numpy as np
import pytest

from polychirp.channel.base import all_pairs
from polychirp.channel.clutter.foliage import foliage_paths
from polychirp.channel.clutter.rough_plates import diffuse_paths
from polychirp.channel.specular.double_plates import corner_paths
from polychirp.channel.tracers.composite import Composite
from polychirp.model.radar import Radar
from polychirp.traffic.paper import paper_mounts, paper_street

MECHANISMS = {
    "corners": corner_paths,
    "diffuse": lambda world, pairs: diffuse_paths(world, pairs, seed=1),
    "foliage": lambda world, pairs: foliage_paths(world, pairs, seed=1),
}


@pytest.mark.parametrize("copies", [1, 4], ids=["4 radars", "16 radars"])
@pytest.mark.parametrize("name", MECHANISMS)
def test_a_mechanism_on_the_street(benchmark, name, copies):
    street = paper_street(max_edge=0.1)
    radars = [
        (Radar(name=f"{carrier} {copy}", mount=mount), carrier)
        for copy in range(copies)
        for carrier, mount in paper_mounts().values()
    ]
    scene, tracer = street.scene(radars), Composite()
    pairs, mechanism = all_pairs(scene), MECHANISMS[name]
    mechanism(tracer.prepare(scene), pairs)
    worlds = (tracer.prepare(scene.at(t)) for t in np.arange(1, 10_000) * 1e-3)
    paths = benchmark(lambda: mechanism(next(worlds), pairs))
    benchmark.extra_info["paths"] = paths.num_paths
    benchmark.extra_info["plates"] = sum(len(actor.plates) for actor in scene.actors)
