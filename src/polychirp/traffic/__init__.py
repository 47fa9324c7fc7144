"""Traffic: vehicles, roadside and street become a `Scene`.

The modules in reading order, each with the names that other packages may use:

- `surface`: meshes from lines of points: `subdivided`, `mirrored`.
- `outline`, `shell`: outlines of cars from above, made of arcs, and curved shells on them.
- `shapes`: dimensions of the four bodies of one piece: `Body`.
- `vehicle_parts`: wheels, and sheets between four corners: `wheel`, `sheet`.
- `semi_trailer`: tractor and semi-trailer of the articulated truck: `coupled`.
- `vehicle`: meshes of the bodies: `vehicle_mesh`, `vehicle_size`.
- `mounting`: places of radars on bumpers: `bumper_mount`.
- `mesh_check`, `mesh_file`: meshes from and to files: `load_mesh`, `save_glb`, `TABLE_MATERIALS`.
- `roadside`: walls of buildings, and meshes of trees: `upright`, `tree_mesh`.
- `manhole`: covers of manholes and their frames: `ManholeCover`.
- `furniture`: guard rails, signs, bollards, kerbs and manhole covers: `AnyFurniture`.
- `articulated_bodies`: people and two-wheelers whose limbs and wheels move.
- `road_users`: what a study file says of them: `Pedestrian`, `Bicycle`, `Motorcycle`.
- `street`: what a study file may place: `Street`, `Vehicle`, `Building`, `Tree`, `Road`, `Point`.
- `placing`, `random_traffic`: vehicles at random places: `RandomTraffic`, `Lane`.
- `paper`: the street of the paper: `paper_street`, `paper_mounts`.
"""
