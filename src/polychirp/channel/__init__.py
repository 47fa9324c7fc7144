"""Ray tracing: from a scene to its propagation paths, from every transmitter to every receiver.

`base` holds the protocol `RayTracer` and builds path tables; `rcs` computes cross sections of
meshes. The rooms, from the lowest to the highest; each imports only from those before it:

* `geometry`: rays among triangles, nearest points, delays between moving points;
* `materials`: permittivities, and reflection and transmission of layers;
* `scene`: a scene prepared for rays; shadows, losses in sheets and leaves, ground truth;
* `direct`: line of sight, and echoes of point scatterers;
* `specular`: mirror images in large plates and in pairs of plates;
* `diffraction`: waves around the edges of bodies;
* `physical_optics`: echoes of meshed bodies, facet by facet;
* `ray_tubes`: reflections between bodies;
* `clutter`: rough plates and foliage, as scatterers of random phase;
* `point_vehicles`: vehicles as a few scattering points, for hundreds of vehicles;
* `tracers`: the tracers that a study may name, and interpolation of their paths in time.

Other packages use `base`, `rcs`, `tracers`, `point_vehicles.tracer`, `scene.ground_truth` and
`materials.library`.
"""
