"""One module for each kind of figure; each gives a figure with its data as a `Drawing`.

The modules in reading order; other packages use the functions that draw, and `rcs.statistics`:

- `drawing`: `Drawing`, colours and the common style.
- `spectrogram`: figure 4.
- `correlation`: figures 6 and 7, and correlations and ambiguities of any signals.
- `surfaces`, `street_plan`, `street_view`: figure 8, from above and in three dimensions.
- `range_profile`, `profile_pair`: figures 9 to 11, and two of them on one scale.
- `detection_statistics`: figures 12 and 13.
- `floor_and_masking`: floor rise, misses and ghosts of every variant.
- `roc`: detection probability over SNR, and false alarms.
- `panels`: maps of the parts of a frame beside each other.
- `range_power_parts`, `range_rate_parts`, `range_azimuth_parts`, `spectrogram_parts`: the parts of
  a frame over range, range rate, azimuth and time.
- `place_labels`, `detections_plan`: detections with their causes over the truth, and labels clear
  of them.
- `grid_axis`, `study_curves`: results of a study over an axis of its grid, and paired differences.
- `comparison`: schemes over the scenarios of several studies.
- `range_rate`: a map of range and range rate with its detections.
- `rcs`, `convergence`: cross sections over aspect, and over the number of facets.
- `diversity`, `ghosts`, `estimation_bound`, `growth`: figures of the pages in docs/validation.
"""
