"""Errors of real hardware: phase noise, nonlinear ramps, filters, converters.

In reading order:

* `oscillator_errors`: `Oscillating`, an engine with the errors of both radars' oscillators
* `phase_error`: the error of one radar's phase over a frame; `splines`: compiled splines for it
* `front_end`: the steps from the IF filter to the samples: `linear_steps`, `distortion`
* `high_pass`: the analog high-pass; `adc`: gain control, saturation and quantisation
"""
