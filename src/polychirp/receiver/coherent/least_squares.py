r"""Gauss–Newton steps: motions and amplitudes of all points at once, group by group.

The signal of point p on channel m and ramp k is :math:`\alpha_{pm}\,g_{pk}\,s_{pkn}`, with the
unit signal s of its motion and the known shape g (`Observation.shape`). Its derivative by the
quantity i of the motion is :math:`j\,\alpha_{pm}\,g_{pk}\,(A_{pki} + B_{ki}u_n)\,s_{pkn}`, with u
the time from the middle of the ramp, A the derivative of the phase there and B that of the beat.
Amplitudes are linear and are eliminated from the normal equations (variable projection, Golub and
Pereyra 1973). The points of a group overlap each other; groups are solved separately.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.jit import reordered
from polychirp.receiver.angle.doa import ESTIMATORS
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.replicas import Replicas, products
from polychirp.receiver.estimation.azimuth_rate import TYPICAL_CROSSING_SPEED

ACCELERATION_DEVIATION = 10.0
"""Standard deviation of a priori known range accelerations, m/s²; chosen: it decides for points
that are too weak to measure theirs, and hardly counts for others."""

REGULARISATION = 1e-9
"""Share added to the diagonal of normalised equations; chosen: it bounds points that coincide."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Steps:
    """Gauss–Newton steps of points.

    Parameters
    ----------
    motion : changes of the motions, ``(point, 4)``, limited to half a cell
    phase : by which the signals turn with them, rad, ``(point, channel)``
    power : fall of the fit if a point were left out where it is, over its floor, ``(point,)``
    gain : expected fall of the residual's power by each group, W, ``(group,)``
    """

    motion: FloatArray
    phase: FloatArray
    power: FloatArray
    gain: FloatArray

    def __getitem__(self, which: IntArray) -> "Steps":
        """Steps of some points, with the gains of all groups."""
        return replace(
            self, motion=self.motion[which], phase=self.phase[which], power=self.power[which]
        )


def steps(
    seen: Observation, points: Points, here: Replicas, sums: ComplexArray, group: IntArray
) -> Steps:
    """Steps of the points of each group, from the residual without all points.

    Parameters
    ----------
    here : replicas of the points
    sums : of the residual at the points, as of `Residual.sums`
    group : number of each point's group, ``(point,)``
    """
    value, moment = (mixed(seen, part) for part in here.matched(sums))
    slopes, common = _centred(seen, points.motion)
    gram = products(seen, here, group)
    total = gram[0].sum(axis=-1)
    matched = value.sum(axis=-1)
    derivative = 1j * mixed(seen, points.amplitude)
    right = np.real(
        np.einsum("pm,pmki,pmk->pi", derivative.conj(), slopes[0], value)
        + np.einsum("pm,pmki,pmk->pi", derivative.conj(), slopes[1], moment)
    )
    normal, cross = _normal_equations(derivative, slopes[0], slopes[1], gram, group)
    prior = _prior(points)
    right -= prior * points.motion
    change = np.zeros_like(points.motion)
    gain = np.zeros(int(np.max(group, initial=-1)) + 1)
    power = np.sum(np.abs(derivative) ** 2, axis=1) / points.floor
    for number, members in by_size(group):
        first, second = members[:, :, None], members[:, None, :]
        inverse = inverses(total[first, second])
        white = matched[members]
        mutual = cross[first, :, :, second].transpose(0, 1, 3, 4, 2)
        solved = mutual @ inverse[:, None, None]
        block = normal[first, :, second].transpose(0, 1, 3, 2, 4)
        block = block - np.real(np.einsum("gpimr,gsjmr->gpisj", solved, mutual.conj()))
        side = right[members] - np.real(np.einsum("gpimr,grm->gpi", solved, white))
        step = _solved(block, side, prior[members])
        change[members] = step
        power[members] /= np.maximum(np.diagonal(inverse, axis1=1, axis2=2).real, 1e-300)
        gain[number] = np.einsum("gpi,gpi->g", side, step) + _fall(inverse, white)
    change = _limited(seen, change)
    phase = np.einsum("pmi,pi->pm", common, change)
    return Steps(motion=change, phase=phase, power=power, gain=gain)


def fitted(
    seen: Observation, points: Points, here: Replicas, sums: ComplexArray, group: IntArray
) -> tuple[Points, Replicas]:
    """Points with the amplitudes that fit best, and their replicas; parameters as of `steps`."""
    matched = here.matched(sums)[0].sum(axis=-1)
    total = products(seen, here, group)[0].sum(axis=-1)
    amplitude = points.amplitude.copy()
    size = np.ones(len(points))
    for _, members in by_size(group):
        inverse = inverses(total[members[:, :, None], members[:, None, :]])
        amplitude[members] += inverse @ matched[members]
        size[members] = np.diagonal(inverse, axis1=1, axis2=2).real
    power = np.sum(np.abs(mixed(seen, amplitude)) ** 2, axis=1)
    power = power / np.maximum(size, 1e-300) / points.floor
    better = replace(points, amplitude=amplitude, power=power)
    return better, replace(here, amplitude=amplitude)


def by_size(group: IntArray) -> list[tuple[IntArray, IntArray]]:
    """Numbers ``(group,)`` and points ``(group, member)`` of the groups of each size."""
    order = np.argsort(group, kind="stable")
    number, first, size = np.unique(group[order], return_index=True, return_counts=True)
    return [
        (number[size == n], order[first[size == n][:, None] + np.arange(n)])
        for n in np.unique(size)
    ]


def mixed(seen: Observation, value: ComplexArray) -> ComplexArray:
    """Values ``(point, channel, …)`` on channels whose noise is white."""
    return np.asarray(np.einsum("ab,pb...->pa...", seen.mixing, value))


def inverses(gram: ComplexArray) -> ComplexArray:
    """Inverses of Gram matrices ``(group, member, member)``, slightly regularised."""
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(gram, axis1=1, axis2=2).real, 1e-300))
    outer = scale[:, :, None] * scale[:, None, :]
    return np.asarray(np.linalg.inv(gram * outer + REGULARISATION * np.eye(gram.shape[1])) * outer)


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


def _prior(points: Points) -> FloatArray:
    """Weights of the motions that are known a priori, ``(point, 4)``."""
    prior = np.zeros_like(points.motion)
    # half the noise power: the sums are of complex samples, of which noise has both parts
    prior[:, 2] = 0.5 * points.floor / ACCELERATION_DEVIATION**2
    prior[:, 3] = 0.5 * points.floor * (points.motion[:, 0] / TYPICAL_CROSSING_SPEED) ** 2
    return prior


def _fall(inverse: ComplexArray, matched: ComplexArray) -> FloatArray:
    """Fall of the power by amplitudes that fit best, ``(group,)``."""
    return np.asarray(np.real(np.einsum("gpm,gpq,gqm->g", matched.conj(), inverse, matched)))


def _solved(normal: FloatArray, right: FloatArray, prior: FloatArray) -> FloatArray:
    """Solutions of normal equations ``(group, member, quantity, …)``, with unit diagonals."""
    groups, members, quantities = right.shape
    size = members * quantities
    normal = normal.reshape(groups, size, size)
    normal = normal + prior.reshape(groups, size, 1) * np.eye(size)
    unit = 1.0 / np.sqrt(np.maximum(np.diagonal(normal, axis1=1, axis2=2), 1e-300))
    scaled = normal * unit[:, :, None] * unit[:, None, :] + 1e-6 * np.eye(size)
    step = np.linalg.solve(scaled, (unit * right.reshape(groups, size))[..., None])[..., 0]
    return np.asarray((unit * step).reshape(right.shape))


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


@reordered
def _normal_equations(
    derivative: Any, phase: Any, beat: Any, gram: Any, group: Any
) -> Any:  # pragma: no cover - compiled
    """Overlaps of derivatives with each other, and with signals.

    They are ``(point, quantity, point, quantity)`` and ``(point, quantity, channel, point)``.
    """
    points, channels, ramps, quantities = phase.shape
    normal = np.zeros((points, quantities, points, quantities))
    cross = np.zeros((points, quantities, channels, points), dtype=np.complex128)
    for p in range(points):
        for q in range(points):
            if group[p] != group[q]:
                continue
            for m in range(channels):
                weight = np.conj(derivative[p, m]) * derivative[q, m]
                for k in range(ramps):
                    a = weight * gram[0, p, q, k]
                    b = weight * gram[1, p, q, k]
                    c = weight * gram[2, p, q, k]
                    for i in range(quantities):
                        x, y = phase[p, m, k, i], beat[p, m, k, i]
                        by_phase = a.real * x + b.real * y
                        by_beat = b.real * x + c.real * y
                        for j in range(quantities):
                            normal[p, i, q, j] += (
                                by_phase * phase[q, m, k, j] + by_beat * beat[q, m, k, j]
                            )
                        cross[p, i, m, q] += np.conj(derivative[p, m]) * (
                            x * gram[0, p, q, k] + y * gram[1, p, q, k]
                        )
    return normal, cross
