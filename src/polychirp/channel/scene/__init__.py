"""A scene prepared for rays, and everything that can be asked of it without waves being scattered.

* `world`: surfaces of bodies, plates and poses (`World`, `world_of`);
* `blockers`: the same in few tables, for kernels;
* `occlusion`: shadow tests (`blocked`); `embree`: the same by Embree;
* `transmission`: losses in thin sheets and leaves (`transmission_matrices`);
* `shadow_tests`: shadow rays for the strongest paths first (`strongest_visible`);
* `ground_truth`: nearest visible points of targets (`truth`), and the check of radar mounts.

Names in brackets are for the other rooms of `channel`, and `blockers` for their kernels; other
packages use `ground_truth`.
"""
