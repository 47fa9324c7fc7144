"""Ray tracing: from a scene to its propagation paths, from every transmitter to every receiver.

These are its packages, and two modules; each imports only from those above it in this list:

* `geometry`: rays among triangles, nearest points, delays between moving points;
* `materials`: permittivities, and reflection and transmission of layers;
* `scene`: a scene prepared for rays; shadows, losses in sheets and leaves, ground truth;
* `base` (a module): `RayTracer`, the protocol of all tracers; functions that build path tables;
* `direct`: line of sight, and echoes of point scatterers;
* `specular`: mirror images in large plates and in pairs of plates;
* `physical_optics`: echoes of meshed bodies, facet by facet;
* `diffraction`: waves around the edges of bodies;
* `ray_tubes`: reflections between bodies;
* `clutter`: echoes with random phases, of rough plates and foliage;
* `tracers`: the tracers that a study may name, and interpolation of their paths in time;
* `point_vehicles`: a tracer that represents each vehicle by a few scattering points;
* `rcs` (a module): radar cross sections of meshes.

Packages outside use `base`, `rcs`, `tracers`, `point_vehicles.tracer`, `scene.ground_truth`,
`materials.library`, and two single names: `geometry.bvh.Caster` and `direct.line_of_sight`.
"""
