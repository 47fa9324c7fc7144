"""Limits of a study, found before it runs: all that it cannot do, or does only in part.

`study.check` uses all of them. A study that cannot run raises an error; one that can, but hardly is
meant so, gets a sentence for a warning. The modules; others may use the names beside them:

- `problems`: places of a study file that prevent it from running: `problems`.
- `size`: memory of a study, estimated before it is allocated: `refuse_too_large`, `frame_bytes`.
- `derived_radar`: resolution, limits and size of a radar's frame: `DerivedRadar`.
- `bands`: bands that resolve ranges, of each ramp and of all together: `joint_band`.
- `beams`: width of an array's beam, and gains that an element's beam does not allow.
- `power`: powers of a radar, and SNRs of points by the radar equation: `point_echoes`.
- `frames`: frames that a radar cannot sample, or its receiver cannot read: `refuse_unread`.
- `radios`: carriers, powers, mounts, elements and sample rates that hardly are meant.
- `receivers`: ramps and arrays that suit a receiver in part only.
- `targets`: targets without an echo, too far, behind the radar or too fast: `targets_out_of_reach`.
- `access`: rules of access that keep nobody apart: `access_in_vain`.
- `interferers`: radars of which a victim receives nothing: `silent_radars`.
"""
