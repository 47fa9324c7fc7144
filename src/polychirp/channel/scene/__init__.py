"""A scene prepared for rays: its surfaces, shadows, transmission losses and ground truth.

* `world`: surfaces of bodies, plates and poses (`World`, `world_of`);
* `blockers`: the same in a few tables, for compiled kernels;
* `occlusion`: shadow tests (`blocked`); `embree`: the same tests by the library Embree;
* `transmission`: losses in thin sheets and leaves (`transmission_matrices`);
* `shadow_tests`: shadow rays for the strongest paths first (`strongest_visible`);
* `ground_truth`: nearest visible points of targets (`truth`), and the check of radar mounts.

Other subpackages of `channel` use the names in brackets, and their kernels use `blockers`; other
packages use `ground_truth`.
"""
