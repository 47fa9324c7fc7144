r"""Gauss–Newton steps: motions and amplitudes of several points at once, by least squares.

The signal of point p on channel m and ramp k is :math:`\alpha_{pm}\,g_{pk}\,s_{pkn}`, with the
unit signal s of its motion and the known shape g (`Observation.shape`). Its derivative by the
quantity i of the motion is :math:`j\,\alpha_{pm}\,g_{pk}\,(A_{pki} + B_{ki}u_n)\,s_{pkn}`, with u
the time from the middle of the ramp, A the derivative of the phase there and B that of the beat.
Amplitudes are linear and are eliminated from the normal equations (variable projection, Golub and
Pereyra 1973).
"""

from dataclasses import dataclass, replace

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.angle.doa import ESTIMATORS
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import overlaps
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.signals import moments
from polychirp.receiver.estimation.azimuth_rate import TYPICAL_CROSSING_SPEED

ACCELERATION_DEVIATION = 10.0
"""Standard deviation of a priori known range accelerations, m/s²; chosen: it decides for points
that are too weak to measure theirs, and hardly counts for others."""

REGULARISATION = 1e-9
"""Share added to the diagonal of normalised equations; chosen: it bounds points that coincide."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Step:
    """Result of one Gauss–Newton step.

    Parameters
    ----------
    points : the points after the step
    gain : expected fall of the residual's power by the step, in units of the floor
    """

    points: Points
    gain: float


def gauss_newton(
    seen: Observation, residual: ComplexArray, points: Points, *, share: float = 1.0
) -> Step:
    """One step of ``points`` jointly, from the residual without them and all other points.

    Steps are limited to half a cell, within which the phases are nearly linear. The motions go this
    ``share`` of their step; if it is 0, amplitudes alone are fitted.
    """
    sums = moments(residual, seen.present, seen.phases(points.motion), seen.model.times)
    return step_from(seen, points, sums, share=share)


def step_from(seen: Observation, points: Points, sums: ComplexArray, *, share: float = 1.0) -> Step:
    """The step of `gauss_newton` that follows from the `moments` of the residual."""
    motion = points.motion
    main = seen.shape(motion, points.sine).conj() * seen.weights(motion)[:, None, :, None]
    value = np.einsum("pmki,ipmk->pmk", main, sums)
    moment = np.einsum("pmki,ipmk->pmk", main[..., :2], sums[1:])
    gram = overlaps(seen, points)
    total = gram[0].sum(axis=-1)
    inverse = _inverse(total)
    matched = value.sum(axis=-1)
    change, won = np.zeros_like(motion), 0.0
    turn = np.ones_like(matched)
    if share > 0.0:
        slopes, common = _centred(seen, motion)
        white = replace(points, amplitude=_mixed(seen, points.amplitude))
        change, won = _motion_step(
            white,
            slopes,
            gram,
            inverse,
            _mixed(seen, value),
            _mixed(seen, moment),
            _mixed(seen, matched),
        )
        change = share * _limited(seen, change)
        turn = np.exp(-1j * np.einsum("pmi,pi->pm", common, change))
        matched = matched - _turn(points, slopes, gram, change)
    added = inverse @ matched
    won += float(np.real(np.vdot(_mixed(seen, matched), _mixed(seen, added))))
    amplitude = (points.amplitude + added) * turn
    power = np.sum(np.abs(_mixed(seen, amplitude)) ** 2, axis=1)
    power = power / np.maximum(np.diag(inverse).real, 1e-300) / points.floor
    moved = replace(points, motion=motion + change, amplitude=amplitude)
    return Step(
        points=replace(moved, sine=sines(seen, amplitude), power=power),
        gain=won / float(np.min(points.floor)),
    )


def _mixed(seen: Observation, value: ComplexArray) -> ComplexArray:
    """Values ``(point, channel, …)`` on channels whose noise is white."""
    return np.asarray(np.einsum("ab,pb...->pa...", seen.mixing, value))


def sines(seen: Observation, amplitude: ComplexArray) -> FloatArray:
    """Sines of the azimuths to which most power of ``amplitude`` ``(point, channel)`` belongs."""
    channel_y = seen.model.channel_y
    if channel_y.size < 2:
        return np.zeros(len(amplitude))
    spacing = float(channel_y[1] - channel_y[0]) * float(seen.frequency.mean()) / SPEED_OF_LIGHT
    return ESTIMATORS["bartlett"](amplitude[:, :, None], spacing=spacing)


def _centred(seen: Observation, motion: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Slopes of `Observation.phase_slopes` less the phase's mean over the frame, and that mean.

    A step in range turns all phases by many cycles alike, which the amplitude takes back exactly.
    """
    slopes = seen.phase_slopes(motion)
    common = np.einsum("k,pmki->pmi", seen.count, slopes[0]) / seen.count.sum()
    slopes[0] -= common[:, :, None]
    return slopes, common


def _inverse(gram: ComplexArray) -> ComplexArray:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram).real, 1e-300))
    normal = gram * np.outer(scale, scale)
    normal = normal + REGULARISATION * np.eye(len(gram))
    return np.asarray(np.linalg.inv(normal) * np.outer(scale, scale))


def _motion_step(
    points: Points,
    slopes: FloatArray,
    gram: ComplexArray,
    inverse: ComplexArray,
    value: ComplexArray,
    moment: ComplexArray,
    matched: ComplexArray,
) -> tuple[FloatArray, float]:
    """Change of the motions, ``(point, quantity)``, and the fall of power that it brings."""
    phase, beat = slopes
    count, motion_size = points.motion.shape
    derivative = 1j * points.amplitude
    right = np.real(
        np.einsum("pm,pmki,pmk->pi", derivative.conj(), phase, value)
        + np.einsum("pm,pmki,pmk->pi", derivative.conj(), beat, moment)
    )
    # overlaps of derivatives with each other, and with signals: the amplitudes take their share
    by_phase = derivative[:, :, None, None] * phase
    by_beat = derivative[:, :, None, None] * beat
    normal = np.einsum("pmki,qmkj,pqk->piqj", by_phase.conj(), by_phase, gram[0])
    normal += np.einsum("pmki,qmkj,pqk->piqj", by_phase.conj(), by_beat, gram[1])
    normal += np.einsum("pmki,qmkj,pqk->piqj", by_beat.conj(), by_phase, gram[1])
    normal += np.einsum("pmki,qmkj,pqk->piqj", by_beat.conj(), by_beat, gram[2])
    cross = np.einsum("pmki,pqk->pimq", by_phase.conj(), gram[0])
    cross += np.einsum("pmki,pqk->pimq", by_beat.conj(), gram[1])
    solved = np.einsum("pimq,qr->pimr", cross, inverse)
    normal = np.real(normal - np.einsum("pimr,sjmr->pisj", solved, cross.conj()))
    right = right - np.real(np.einsum("pimr,rm->pi", solved, matched))
    size = motion_size * count
    normal = normal.reshape(size, size)
    prior = np.zeros((count, motion_size))
    # half the noise power: the sums above are of complex samples, of which noise has both parts
    prior[:, 2] = 0.5 * points.floor / ACCELERATION_DEVIATION**2
    prior[:, 3] = 0.5 * points.floor * (points.motion[:, 0] / TYPICAL_CROSSING_SPEED) ** 2
    right = right.reshape(-1) - (prior * points.motion).reshape(-1)
    normal = normal + np.diag(prior.reshape(-1))
    unit = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    scaled = normal * np.outer(unit, unit) + 1e-6 * np.eye(size)
    step = unit * np.linalg.solve(scaled, unit * right)
    return step.reshape(count, motion_size), float(right @ step)


def _limited(seen: Observation, change: FloatArray) -> FloatArray:
    """Steps shortened to less than half a cell of range, range rate and acceleration."""
    limit = np.array(
        [
            0.5 * seen.range_cell,
            0.5 * seen.range_rate_cell,
            2.0 * seen.range_rate_cell / seen.duration,
            1.0 / seen.duration,
        ]
    )
    excess = np.max(np.abs(change) / limit, axis=1, keepdims=True)
    return np.asarray(change / np.maximum(excess, 1.0))


def _turn(
    points: Points, slopes: FloatArray, gram: ComplexArray, change: FloatArray
) -> ComplexArray:
    """Change of the matched sums by a step of the motions, to first order, ``(point, channel)``."""
    phase, beat = np.einsum("pi,dpmki->dpmk", change, slopes)
    single = np.einsum("pmk,pqk->pmq", phase.conj(), gram[0])
    single += np.einsum("pmk,pqk->pmq", beat.conj(), gram[1])
    return np.asarray(np.einsum("pmq,pm->qm", single.conj(), 1j * points.amplitude))
