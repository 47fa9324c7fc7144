"""From a scene to its propagation paths, by geometry alone: every transmitter to every receiver."""
