"""Geometry of rays and points, without waves.

* `vectors`: vectors as tuples, for compiled kernels;
* `bvh`: a tree of boxes over triangles; closest hit and occlusion (`Caster`, `first_hit`);
* `wide_bvh`: the closest hit with eight boxes at a time (`nearest_hit`);
* `closest_point`: nearest point of every triangle to a place;
* `enclosure`: volume of closed surfaces, and points inside them;
* `retarded_delay`: exact delays between points that move in straight lines.

The whole package `channel` may use all public names.
"""
