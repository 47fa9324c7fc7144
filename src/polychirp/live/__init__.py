"""The live page: a street with two radars whose settings can be changed while one looks.

The modules in reading order; the command `polychirp live` uses `page`:

- `settings`: values of the controls, and the study that they make.
- `presets`: settings to begin from.
- `look`: spectra, maps and paths of a study, in a tenth of a second; detections; a full trace.
- `plots`: Plotly figures of a look, as plain dicts.
- `copies`: the settings as a study file and as a Python script.
- `street_scene`: the street in three dimensions.
- `controls`: sliders and lists.
- `page`: the page and its server.
"""
