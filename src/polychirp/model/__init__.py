"""Small immutable data types that the stages exchange; all of them are public.

The modules in reading order:

- `material`, `mesh`, `scene`: bodies: `Material`; `Mesh`, `Plate`; `Actor`, `Scene`.
- `antenna`, `oscillator`, `if_filter`, `front_end`, `leakage`: parts of a radar: `AntennaArray`,
  `Oscillator`, `IfFilter`, `FrontEnd`, `Leakage`, `Bumper`.
- `radar`: all of them in one `Radar`, with its `Converter`.
- `ramp`: the ramps that a radar transmits: `RampSchedule`.
- `paths`: the channel between all radars: `PropagationPaths`, `Bounce`.
- `if_frame`: dechirped samples and their parts: `IfFrame`, `IfParts`, `SampleTimes`.
- `spectra`: spectra with their axes: `RangeProfiles`, `RangeRateSpectra`, `RangeRateMap`.
- `detection`, `truth`, `score`: results: `Detections`, `Truth`, `Score`.
- `placement`: poses of a radar and boxes around bodies in the world: `Placement`, `placement`.
- `baseband`, `transceiver`: signals of software-defined radios, and such a radio: `Baseband`,
  `SampleSource`, `Transceiver`, `Link`.
"""
