"""`carriers`: the schedule of equal stretches of one carrier with a code."""

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.model.ramp import RampSchedule, continuous_phase
from polychirp.model.ramp_code import RampCode
from polychirp.waveform.base import need_sweeps


def carriers(
    chips: FloatArray | ComplexArray,
    *,
    carrier: float,
    chip_duration: float,
    duration: float,
    idle: float,
    num_sweeps: int,
) -> RampSchedule:
    """Schedule of ``num_sweeps`` ramps of slope zero, which repeat their code until they end.

    The carrier's phase is continuous; idle times do not advance it (`continuous_phase`).

    Parameters
    ----------
    chips : ``(code, chip)``; one code for all sweeps, or one for each
    carrier : Hz
    chip_duration, duration, idle : s

    Examples
    --------
    >>> plan = carriers(np.array([[1.0, -1.0, 1.0]]), carrier=79e9, chip_duration=2e-9,
    ...     duration=12e-9, idle=1e-6, num_sweeps=2)
    >>> plan.code.row, (plan.start_time * 1e9).round(6)
    (array([0, 0]), array([   0., 1012.]))
    """
    need_sweeps(num_sweeps)
    number = np.arange(num_sweeps)
    ramps = {
        "duration": np.full(num_sweeps, duration),
        "start_frequency": np.full(num_sweeps, carrier),
        "slope": np.zeros(num_sweeps),
    }
    return RampSchedule(
        **ramps,
        start_time=np.asarray(number * (duration + idle), dtype=np.float64),
        start_phase=continuous_phase(**ramps),
        sweep=number,
        code=RampCode(
            value=chips.astype(np.complex128),
            row=number if len(chips) > 1 else 0 * number,
            chip_duration=np.full(num_sweeps, chip_duration),
        ),
    )
