import csv
import io
from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.report.figures.drawing import STYLE_FILE, Drawing, csv_of
from polychirp.report.figures.floor_and_masking import floor_and_masking
from polychirp.report.figures.range_profile import common_limits, range_profile
from polychirp.report.figures.spectrogram import band_of, short_time_spectrum, spectrogram
from polychirp.report.figures.street_plan import street_plan
from polychirp.report.figures.street_view import Camera, overview, render, street_view
from polychirp.report.figures.surfaces import radar_paint, surfaces


class PatientCaster:
    """Every ray against every triangle, after Möller and Trumbore."""

    def __init__(self, triangles):
        self.triangles = triangles

    def closest(self, origins, directions):
        nearest = np.full(origins.shape[0], np.inf)
        face = np.zeros(origins.shape[0], dtype=np.int64)
        for number, (a, b, c) in enumerate(self.triangles):
            across = np.cross(directions, c - a)
            determinant = across @ (b - a)
            determinant[np.abs(determinant) < 1e-12] = np.nan
            offset = origins - a
            u = np.sum(offset * across, axis=1) / determinant
            turned = np.cross(offset, b - a)
            v = np.sum(directions * turned, axis=1) / determinant
            distance = turned @ (c - a) / determinant
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 1e-9) & (distance < nearest)
            nearest[hit], face[hit] = distance[hit], number
        return nearest, face

    def occluded(self, origins, ends):
        return self.closest(origins, ends - origins)[0] < 1.0


def labels(axes):
    return [line.get_label() for line in axes.lines if not line.get_label().startswith("_")]


def table(drawing: Drawing):
    return list(csv.DictReader(io.StringIO(drawing.csv())))


# ── every figure ──────────────────────────────────────────────────────────────


def test_text_of_the_data_is_never_a_formula():
    """Numbers stay numbers, and the label '-10 dB' is text."""
    content = csv_of({"label": ["-10 dB", "=1+1", "front"], "=level": [-10.0, 1.0, 2.0]})
    assert content == "label,'=level\n'-10 dB,-10\n'=1+1,1\nfront,2\n"


def test_figures_leave_no_trace_in_global_settings(results):
    before = dict(mpl.rcParams)
    range_profile(results.rows[0], heading="Fig. 9a", limits=(-100.0, 0.0)).png()
    assert dict(mpl.rcParams) == before


def test_figures_look_the_same_whatever_the_users_settings_are(results):
    def draw():
        return range_profile(results.rows[0], heading="Fig. 9a", limits=(-100.0, 0.0)).png()

    house = draw()
    with mpl.rc_context({"lines.linewidth": 9.0, "savefig.dpi": 30, "font.size": 30}):
        assert draw() == house
    assert house.startswith(b"\x89PNG")
    assert STYLE_FILE.is_file()


# ── figure 4 ──────────────────────────────────────────────────────────────────


def test_the_closed_form_agrees_with_summing_the_signal():
    """At a megahertz instead of a gigahertz the signal can be sampled and its integral summed.

    The trapezoidal sum of 4 million points errs by less than 1e-4 of the window's area: the
    integrand is cut at the ramps' ends, where one step, 1e-9 s of 20 µs, is the error.
    """
    ramps = RampSchedule(
        start_time=[0.0, 1e-3, 2.5e-3],
        duration=[1e-3, 1e-3, 0.5e-3],
        start_frequency=[5e6, 6e6, 5e6],
        slope=[1e9, -1e9, 3e9],
        start_phase=[0.0, 0.5, 0.25],
        sweep=[0, 0, 1],
    )
    window = 20e-6
    step = 1e-9
    u = (np.arange(round(3e-3 / step)) + 0.5) * step
    signal = np.zeros(u.size, dtype=np.complex128)
    for k in range(3):
        s = u - ramps.start_time[k]
        on = (s >= 0) & (s < ramps.duration[k])
        cycles = ramps.start_phase[k] + ramps.start_frequency[k] * s + ramps.slope[k] * s**2 / 2
        signal[on] = np.exp(2j * np.pi * cycles[on])
    time = np.array([0.0, 0.4e-3, 1e-3, 1.01e-3, 2.03e-3, 2.52e-3])
    frequency = np.array([5.0e6, 5.4e6, 5.98e6, 6.0e6])
    found = short_time_spectrum(ramps, time=time, frequency=frequency, window=window)
    for column, t in enumerate(time):
        near = np.abs(u - t) < 8 * window
        seen = signal[near] * np.exp(-(((u[near] - t) / window) ** 2) / 2)
        for line, f in enumerate(frequency):
            expected = step * np.sum(seen * np.exp(-2j * np.pi * f * (u[near] - t)))
            error = abs(found[line, column] - expected)
            assert error < 1e-4 * window * np.sqrt(2 * np.pi)


def test_the_spectrogram_is_brightest_along_the_ramps(results):
    schedule = results.diverse
    time = schedule.start_time + 0.5 * schedule.duration
    frequency = np.linspace(79e9, 80e9, 501)
    level = np.abs(short_time_spectrum(schedule, time=time, frequency=frequency, window=20e-6))
    brightest = frequency[np.argmax(level, axis=0)]
    assert brightest == pytest.approx(schedule.centre_frequency, abs=2e6)


def test_a_spectrogram_lists_its_ramps(results):
    band = band_of(results.conventional, results.diverse)
    drawing = spectrogram(results.diverse, title="Fig. 4b", band=band, span=(0.0, 0.1))
    axes, bar = drawing.figure.axes
    assert axes.get_title(loc="left") == "Fig. 4b"
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("Time (ms)", "Frequency (GHz)")
    assert bar.get_ylabel() == "Power (dB)"
    assert axes.get_ylim() == pytest.approx((band[0] / 1e9, band[1] / 1e9))
    assert axes.get_xlim() == pytest.approx((0.0, 100.0))
    lines = table(drawing)
    assert len(lines) == 32
    assert float(lines[1]["stop_frequency_ghz"]) == pytest.approx(79.0)
    assert {line["sweep"] for line in lines} == {str(n) for n in range(16)}


# ── figure 8 ──────────────────────────────────────────────────────────────────


def test_plates_become_two_triangles_that_face_outwards(scene):
    street = surfaces(scene)
    assert street.corners.shape == (2 + 2 + 3 * 12, 3, 3)
    assert street.normal[:2] == pytest.approx(np.array([[0.0, 0.0, 1.0]] * 2))
    areas = np.linalg.norm(
        np.cross(
            street.corners[:, 1] - street.corners[:, 0], street.corners[:, 2] - street.corners[:, 0]
        ),
        axis=1,
    )
    assert areas[:2].sum() / 2 == pytest.approx(80.0 * 12.0)


def test_a_body_with_a_radar_wears_the_radars_colour(scene):
    street = surfaces(scene)
    carrier = street.actor == scene.carriers[0]
    assert np.all(street.colour[carrier] == radar_paint(0))
    assert not np.any(np.all(street.colour[~carrier] == radar_paint(0), axis=1))


def test_the_plan_names_every_vehicle_and_draws_every_beam(scene):
    drawing = street_plan(scene)
    axes = drawing.figure.axes[0]
    texts = "\n".join(text.get_text() for text in axes.texts)
    for name in ("vehicle <1>", "vehicle 2", "radar: radar 2", "36 km/h", "43 km/h", "1 m"):
        assert name in texts
    beam = next(patch for patch in axes.patches if hasattr(patch, "theta1"))
    assert beam.theta2 - beam.theta1 == pytest.approx(160.0)
    assert 0.5 * (beam.theta1 + beam.theta2) == pytest.approx(180.0)  # the carrier drives along −x
    assert beam.center == pytest.approx((8.0 - 2.3, 1.75))
    assert axes.get_aspect() == 1.0
    lines = {line["actor"]: line for line in table(drawing)}
    assert float(lines["vehicle 2"]["velocity_x_mps"]) == -12.0
    assert lines["vehicle 2"]["radars"] == "radar 2"


def test_an_empty_street_has_a_plan():
    assert street_plan(Scene(time=0.0, actors=())).data["actor"] == []


def test_a_camera_sees_a_point_where_it_projects_it():
    camera = Camera(position=(-10.0, 2.0, 5.0), target=(3.0, 0.0, 0.0))
    size = (160, 90)
    points = np.array([[4.0, 1.0, 0.5], [0.0, -3.0, 0.0]])
    rays = camera.directions(camera.project(points, size), size)
    towards = points - np.array(camera.position)
    assert rays == pytest.approx(towards / np.linalg.norm(towards, axis=1, keepdims=True))
    assert camera.project(np.array([3.0, 0.0, 0.0]), size) == pytest.approx([80.0, 45.0])
    assert np.all(np.isnan(camera.project(np.array([-20.0, 2.0, 5.0]), size)))


def test_the_picture_shows_each_material_in_its_colour(scene):
    """Bricks are red, leaves green and the painted car blue, wherever the light comes from."""
    size = (64, 36)
    picture = render(
        scene, camera=overview(scene), size=size, caster=PatientCaster(surfaces(scene).corners)
    ).astype(float)
    assert picture.shape == (36, 64, 3)

    def seen_at(point):
        right, down = np.floor(overview(scene).project(np.array(point), size)).astype(int)
        return picture[down, right]

    red, green, blue = seen_at((0.0, 9.0, 2.0))
    assert red > max(green, blue)
    red, green, blue = seen_at((2.0, -7.0, 3.0))
    assert green > max(red, blue)
    red, green, blue = seen_at((5.76, 1.75, 0.9))
    assert blue > max(red, green)


def test_a_body_throws_a_shadow_on_the_road(scene):
    """The sun stands at −x, −y: the road is darker on the other side of the car."""
    size = (96, 54)
    camera = Camera(position=(-6.0, 0.0, 25.0), target=(-5.9, 0.0, 0.0))
    picture = render(
        scene, camera=camera, size=size, caster=PatientCaster(surfaces(scene).corners)
    ).astype(float)

    def brightness(point):
        right, down = np.floor(camera.project(np.array(point), size)).astype(int)
        return picture[down, right].mean()

    assert brightness((-6.0, -0.6, 0.0)) < 0.7 * brightness((-6.0, -3.1, 0.0))


def test_names_in_the_view_are_not_cut_off(scene):
    """The second vehicle is near the right edge; its name moves to the left."""
    size = (960, 540)
    camera = Camera(position=(-20.0, 0.0, 4.0), target=(0.0, 13.0, 0.0))
    drawing = street_view(
        scene, camera=camera, size=size, caster=PatientCaster(np.zeros((0, 3, 3)))
    )
    drawing.png()
    (label,) = drawing.figure.axes[0].texts
    assert label.xy[0] > size[0] - 40.0
    assert label.get_window_extent().x1 < drawing.figure.bbox.x1


def test_the_view_names_the_vehicles_it_shows(scene):
    size = (64, 36)
    drawing = street_view(scene, size=size, caster=PatientCaster(surfaces(scene).corners))
    axes = drawing.figure.axes[0]
    assert {text.get_text() for text in axes.texts} == {"vehicle <1>", "vehicle 2"}
    assert [line["name"] for line in table(drawing)] == ["vehicle <1>", "vehicle 2"]
    assert axes.images[0].get_array().shape == (36, 64, 3)


# ── figures 9 to 11 ───────────────────────────────────────────────────────────


def test_a_range_profile_shows_truth_detections_ghosts_and_both_levels(make_row):
    row = make_row("C", "radar 2", ghosts=(("direct", 6.6, 22.5),), hidden=("far <car>",))
    drawing = range_profile(row, heading="Fig. 11a", limits=(-100.0, 0.0))
    axes = drawing.figure.axes[0]
    assert labels(axes) == [
        "range profile",
        "thermal noise floor",
        "the paper's threshold, eq. 12, not used here",
        "true target",
        "detection",
        "ghost: direct interference",
    ]
    texts = [text.get_text() for text in axes.texts]
    targets = ["vehicle 2  12.60 m", "vehicle 4  13.65 m", "far <car>  21.00 m  missed"]
    assert texts == [*targets, "6.60 m"]
    title = drawing.figure.get_suptitle()
    for words in (
        "Fig. 11a",
        "C: direct interference",
        "radar 2",
        "conventional",
        "starting together",
    ):
        assert words in title
    assert axes.get_xlim() == (0.0, 30.0)
    assert axes.get_ylim() == (-100.0, 0.0)
    assert "m" in axes.get_xlabel()
    assert "dBm" in axes.get_ylabel()


def test_a_ghost_is_marked_on_the_profile_at_its_range(make_row):
    row = make_row("C", "radar 2", ghosts=(("direct", 6.6, 22.5),))
    drawing = range_profile(row, heading="Fig. 11a", limits=(-100.0, 0.0))
    lines = {line.get_label(): line for line in drawing.figure.axes[0].lines}
    ghost = lines["ghost: direct interference"]
    assert ghost.get_xdata() == pytest.approx([6.6])
    assert ghost.get_ydata() == pytest.approx([-31.0 + 22.5], abs=0.1)


def test_a_ghost_beside_a_stronger_one_has_no_label(make_row):
    ghosts = (("direct", 6.6, 24.0), ("indirect", 6.62, -3.0), ("indirect", 9.7, -10.0))
    drawing = range_profile(make_row("C", "radar 2", ghosts=ghosts), heading="", limits=(-120, 0))
    texts = [text.get_text() for text in drawing.figure.axes[0].texts]
    assert "6.60 m" in texts
    assert "9.70 m" in texts
    assert "6.62 m" not in texts


def test_the_strongest_peak_is_labelled_if_it_is_no_target_and_no_ghost(make_row):
    row = make_row()
    drawing = range_profile(
        replace(row, targets=row.targets[1:]), heading="Fig. 9a", limits=(-100.0, 0.0)
    )
    assert drawing.figure.axes[0].texts[-1].get_text() == "strongest peak 6.50 m"


def test_the_data_of_a_profile_are_what_is_drawn(make_row):
    row = make_row()
    lines = table(range_profile(row, heading="Fig. 9a", limits=(-100.0, 0.0)))
    shown = row.profile_range <= 30.0
    assert [float(line["range_m"]) for line in lines] == pytest.approx(row.profile_range[shown])
    assert [float(line["power_dbm"]) for line in lines] == pytest.approx(
        row.profile_power_db[shown]
    )


def test_panels_to_be_compared_have_one_scale_that_holds_them_all(make_row):
    quiet, loud = make_row(), make_row(ghosts=(("direct", 6.6, 22.5),), floor_rise=20.0)
    low, high = common_limits([quiet, loud])
    assert low <= quiet.noise_floor_db
    assert high >= loud.profile_power_db.max()
    assert low % 10 == high % 10 == 0


def test_a_gap_in_a_profile_does_not_stretch_the_scale(make_row):
    row = make_row()
    power = np.array(row.profile_power_db)
    power[0] = -400.0
    assert common_limits([replace(row, profile_power_db=power)])[0] >= row.noise_floor_db - 30.0


# ── our own ───────────────────────────────────────────────────────────────────


def test_floor_and_masking_has_a_line_per_victim_and_a_mark_per_row(results):
    drawing = floor_and_masking(results.rows)
    axes = drawing.figure.axes
    assert len(axes) == 2 * 3
    titles = [a.get_title(loc="left") for a in axes if a.get_title(loc="left")]
    assert titles == ["B: indirect interference at radar 1", "C: direct interference at radar 2"]
    for panel in axes:
        assert labels(panel) == ["no mitigation", "blanking"]
        assert sum(len(line.get_xdata()) for line in panel.lines) == 12
    lines = table(drawing)
    assert len(lines) == len(results.rows) - 2
    assert max(float(line["floor_rise_db"]) for line in lines) == 28.0


def test_floor_and_masking_needs_interference(make_row):
    with pytest.raises(InputError, match="no row has interference"):
        floor_and_masking([make_row()])
