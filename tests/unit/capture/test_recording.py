from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from polychirp.capture.dca1000 import open_raw
from polychirp.capture.parameters import CaptureParameters
from polychirp.capture.recording import from_array, open_numpy
from polychirp.errors import InputError, ModelWarning
from tests.support.dca1000 import pack_complex, pack_real, write_raw

PARAMETERS = CaptureParameters(
    start_frequency=77e9,
    slope=20e12,
    idle_time=10e-6,
    ramp_end_time=50e-6,
    adc_start=6e-6,
    num_ramps=6,
    sample_rate=1e6,
    num_samples=8,
    num_transmitters=2,
    num_receivers=3,
    full_scale=1.0,
    device="xwr16xx",
)
SHAPE = (3, 6, 8)


def words(*shape: int, seed: int = 1) -> np.ndarray:
    """Complex samples of whole numbers over all 16 bits."""
    random = np.random.default_rng(seed)
    parts = random.integers(-32768, 32768, (2, *shape))
    return parts[0] + 1j * parts[1]


# ── arrays ────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize(
    "axes",
    [
        ("ramp", "receiver", "fast"),
        ("receiver", "ramp", "fast"),
        ("fast", "ramp", "receiver"),
        ("sweep", "channel", "fast"),
        ("channel", "sweep", "fast"),
        ("transmitter", "fast", "sweep", "receiver"),
        ("frame", "ramp", "receiver", "fast"),
        ("ramp", "frame", "receiver", "fast"),
    ],
)
def test_axes_in_any_order_give_the_same_frame(axes: tuple[str, ...]):
    """Samples numbered by where they belong: (receiver, sweep, transmitter, fast)."""
    expected = np.arange(np.prod(SHAPE)).reshape(SHAPE) + 0j
    full = expected.reshape(1, 3, 3, 2, 8)
    names = ["frame", "receiver", "sweep", "transmitter", "fast"]
    pairs = {"ramp": ["sweep", "transmitter"], "channel": ["transmitter", "receiver"]}
    single = [part for axis in axes for part in pairs.get(axis, [axis])]
    moved = full.transpose(
        [names.index(n) for n in single] + [k for k, n in enumerate(names) if n not in single]
    )
    lengths = {**PARAMETERS.lengths, "frame": 1}
    stored = moved.reshape([lengths[axis] for axis in axes])
    recording = from_array(stored, replace(PARAMETERS, axes=axes), name="x")
    np.testing.assert_array_equal(recording.frame(0).samples, expected)


def test_frames_are_told_apart():
    stored = words(4, 6, 3, 8)
    recording = from_array(stored, PARAMETERS, name="x")
    assert recording.num_frames == 4
    np.testing.assert_array_equal(recording.frame(2).samples, stored[2].transpose(1, 0, 2))
    with pytest.raises(InputError, match="no frame 4; it has frames 0 to 3"):
        recording.frame(4)


def test_signed_words_stored_as_unsigned_are_themselves_again():
    stored = words(1, 6, 3, 8)
    unsigned = (stored.real % 65536) + 1j * (stored.imag % 65536)
    parameters = replace(PARAMETERS, stored_as="unsigned")
    np.testing.assert_array_equal(
        from_array(unsigned, parameters, name="x").frame(0).samples,
        from_array(stored, PARAMETERS, name="x").frame(0).samples,
    )


def test_conjugate_left_and_full_scale_do_what_they_say():
    stored = words(1, 6, 3, 8)
    plain = from_array(stored, PARAMETERS, name="x").frame(0).samples
    for change, there, expected in (
        ({"conjugate": True}, stored, plain.conj()),
        ({"first_receiver": "left"}, stored, plain[::-1]),
        ({"full_scale": 32768.0}, stored, plain / 32768.0),
        ({"sampling": "real"}, stored.real, 2.0 * plain.real),
    ):
        read = from_array(there, replace(PARAMETERS, **change), name="x").frame(0)
        np.testing.assert_array_equal(read.samples, expected)


@pytest.mark.parametrize("dtype", [np.int16, np.float32])
def test_real_samples_are_not_read_as_complex_ones(dtype):
    """Every target would have a mirror image, as strong as itself, on the other side of zero."""
    there = words(1, 6, 3, 8).real.astype(dtype)
    with pytest.raises(InputError, match=r"x: holds real samples.*set sampling = 'real', or"):
        from_array(there, PARAMETERS, name="x")
    assert from_array(there, replace(PARAMETERS, sampling="real"), name="x").num_frames == 1


def test_complex_samples_are_not_read_as_real_ones():
    with pytest.raises(InputError, match=r"x: holds complex samples.*set sampling = 'complex'$"):
        from_array(words(1, 6, 3, 8), replace(PARAMETERS, sampling="real"), name="x")


@pytest.mark.parametrize(("sampling", "limit"), [("complex", 1e6), ("real", 0.5e6)])
def test_a_pass_band_ends_where_beats_fold_back(sampling, limit):
    with pytest.raises(InputError, match=r"highest_beat: .* MHz is more than .*sample rate"):
        replace(PARAMETERS, sampling=sampling, highest_beat=1.01 * limit)
    assert replace(PARAMETERS, sampling=sampling, highest_beat=limit).highest_beat == limit


def test_an_array_of_another_shape_is_refused_with_both_shapes():
    message = r"shape \(1, 6, 3, 9\), but its parameters say \(frame, ramp 6, receiver 3, fast 8\)"
    with pytest.raises(InputError, match=message):
        from_array(np.zeros((1, 6, 3, 9)), PARAMETERS, name="x")
    with pytest.raises(InputError, match=r"shape \(6, 3, 8\)"):
        from_array(np.zeros((6, 3, 8)), PARAMETERS, name="x")


def test_missing_frames_are_refused_unless_others_are_asked_for():
    parameters = replace(PARAMETERS, num_frames=4)
    with pytest.raises(InputError, match="3 of 4 frames are there; process frames 0 to 2"):
        from_array(words(3, 6, 3, 8), parameters, name="x")
    assert from_array(words(3, 6, 3, 8), parameters, name="x", frames=[0, 2]).num_frames == 3
    with pytest.raises(InputError) as told:
        from_array(words(3, 6, 3, 8), parameters, name="x", frames=[5])
    assert str(told.value) == (
        "x: only frames 0 to 2 are there, and --frames asks for frame 5; process those with "
        "--frames 0-2"
    )
    with pytest.raises(InputError, match=r"only frame 0 is there, .* with --frames 0$"):
        from_array(words(1, 6, 3, 8), PARAMETERS, name="x", frames=range(2))


# ── NumPy files ───────────────────────────────────────────────────────────────


def test_a_numpy_file_is_its_array(tmp_path: Path):
    stored = words(2, 6, 3, 8)
    np.save(tmp_path / "walk.npy", stored)
    recording = open_numpy(tmp_path / "walk.npy", PARAMETERS)
    expected = from_array(stored, PARAMETERS, name="x").frame(1).samples
    np.testing.assert_array_equal(recording.frame(1).samples, expected)


def test_a_numpy_file_that_was_cut_off_says_how_much_is_missing(tmp_path: Path):
    path = tmp_path / "walk.npy"
    np.save(path, words(2, 6, 3, 8))
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match=r"walk.npy: is 100 bytes short"):
        open_numpy(path, PARAMETERS)


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"", "is not a NumPy file"), (b"hello world, no array", "is not a NumPy file")],
)
def test_what_is_no_numpy_file_is_refused(tmp_path: Path, content: bytes, message: str):
    path = tmp_path / "walk.npy"
    path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        open_numpy(path, PARAMETERS)
    np.save(path, np.array(["a"]))
    with pytest.raises(InputError, match="not numbers"):
        open_numpy(path, PARAMETERS)
    with pytest.raises(InputError, match="there is no recording"):
        open_numpy(tmp_path / "run.npy", PARAMETERS)


# ── TI's raw files ────────────────────────────────────────────────────────────


@pytest.mark.parametrize("device", ["xwr14xx", "xwr16xx", "xwr18xx", "xwr68xx"])
@pytest.mark.parametrize("sampling", ["complex", "real"])
def test_what_is_written_raw_is_read_again(tmp_path: Path, device, sampling: str):
    frames = words(2, *SHAPE)
    path = tmp_path / "walk.bin"
    write_raw(path, frames, device=device, is_complex=sampling == "complex")
    parameters = replace(PARAMETERS, device=device, sampling=sampling)
    recording = open_raw(path, parameters)
    assert recording.num_frames == 2
    expected = frames if sampling == "complex" else frames.real
    for number in range(2):
        np.testing.assert_array_equal(recording.read(number), expected[number])


@pytest.mark.parametrize("bits", [12, 14])
def test_samples_of_fewer_bits_get_their_sign_back(tmp_path: Path, bits: int):
    """The card stores −1 of 12 bits as 0x0FFF; full scale is 2048."""
    half = 2 ** (bits - 1)
    frames = np.random.default_rng(bits).integers(-half, half, (2, *SHAPE, 2)) @ [1, 1j]
    path, cut = tmp_path / "walk.bin", 2**bits - 1
    bare = (frames.real.astype(int) & cut) + 1j * (frames.imag.astype(int) & cut)
    write_raw(path, bare, device="xwr16xx", is_complex=True)
    parameters = replace(PARAMETERS, adc_bits=bits, full_scale=None)
    found = open_raw(path, parameters).frame(1).samples
    np.testing.assert_array_equal(found, frames[1] / half)


def test_a_receiver_that_holds_only_zeros_is_named():
    stored = words(1, 6, 3, 8)
    stored[:, :, 1] = 0.0
    with pytest.warns(ModelWarning, match=r"x: frames hold .* zeros of receiver 1; check"):
        from_array(stored, PARAMETERS, name="x").frame(0)


def test_samples_over_full_scale_are_not_taken_for_counts_in_silence():
    counts = words(1, 6, 3, 8)
    small = counts / np.abs(np.stack([counts.real, counts.imag])).max()
    unsaid = replace(PARAMETERS, full_scale=None)
    with pytest.warns(ModelWarning, match=r"x: no sample exceeds one count .* full_scale=1\.0"):
        from_array(small, unsaid, name="x").frame(0)
    for stored, said in ((small, replace(unsaid, full_scale=1.0)), (counts, unsaid)):
        from_array(stored, said, name="x").frame(0)


def test_a_mirrored_line_is_mirrored_with_its_transmitters():
    """Virtual elements of two transmitters and four receivers make one line from left to right."""
    line = replace(PARAMETERS, num_receivers=4, num_transmitters=2)
    for side, step in (("right", 1.0), ("left", -1.0)):
        array = replace(line, first_receiver=side).array
        receivers = array.position[:: int(step), 1]  # in the order of the file
        virtual = (array.transmit_position[:, None, 1] + receivers).ravel() / array.spacing
        assert np.diff(virtual) == pytest.approx(np.full(7, step))


def numbered(receivers: int, samples: int) -> np.ndarray:
    """Words of one ramp: 100 × receiver + sample, Q negative."""
    value = 100 * np.arange(receivers)[:, None] + np.arange(samples)
    return np.stack([value, -value - 1], axis=-1)[:, None].astype("<i2")


def test_two_lanes_carry_two_i_then_two_q_one_receiver_after_the_other():
    """SWRA581, xWR16xx complex: I0 I1 Q0 Q1 I2 I3 Q2 Q3 of a receiver, then the next one."""
    stream = pack_complex(numbered(2, 4), "xwr16xx")
    assert stream.tolist() == [
        *(0, 1, -1, -2, 2, 3, -3, -4),
        *(100, 101, -101, -102, 102, 103, -103, -104),
    ]
    assert pack_real(numbered(2, 4), "xwr16xx").tolist() == [0, 1, 2, 3, 100, 101, 102, 103]


def test_four_lanes_carry_i_of_all_receivers_then_q_of_all():
    """SWRA581, xWR14xx: one lane for each receiver, sample by sample; unused lanes are zero."""
    stream = pack_complex(numbered(3, 2), "xwr14xx")
    assert stream.tolist() == [
        *(0, 100, 200, 0, -1, -101, -201, 0),
        *(1, 101, 201, 0, -2, -102, -202, 0),
    ]
    assert pack_real(numbered(3, 2), "xwr14xx").tolist() == [0, 100, 200, 0, 1, 101, 201, 0]


@pytest.mark.parametrize("sampling", ["complex", "real"])
def test_receivers_that_are_not_neighbours_are_read_from_their_lanes(tmp_path: Path, sampling):
    """Receivers 1 and 3 of an xWR14xx: the lanes 0 and 2 hold zeros."""
    words, expected = [], np.zeros((2, 6, 8), dtype=complex)
    for ramp in range(6):
        for fast in range(8):
            i1, q1, i3, q3 = (100 * part + 10 * ramp + fast + 1 for part in range(4))
            words += [0, i1, 0, i3]
            words += [0, q1, 0, q3] if sampling == "complex" else []
            expected[:, ramp, fast] = i1 + 1j * q1, i3 + 1j * q3
    path = tmp_path / "walk.bin"
    path.write_bytes(np.array(words, dtype="<i2").tobytes())
    parameters = replace(
        PARAMETERS,
        device="xwr14xx",
        sampling=sampling,
        num_receivers=2,
        enabled_receivers=(1, 3),
        channel_positions=((0, 0), (2, 0)),
    )
    found = open_raw(path, parameters).read(0)
    np.testing.assert_array_equal(found, expected if sampling == "complex" else expected.real)


def test_a_lane_without_a_receiver_that_holds_samples_is_told(tmp_path: Path):
    path = tmp_path / "walk.bin"
    write_raw(path, words(1, *SHAPE), device="xwr14xx", is_complex=True)
    parameters = replace(PARAMETERS, device="xwr14xx", num_receivers=2, enabled_receivers=(1, 3))
    with pytest.warns(ModelWarning, match=r"walk.bin: there are samples on lane 0 and lane 2, but"):
        open_raw(path, parameters).read(0)


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ((1, 2), "names 2 receivers, but num_receivers is 3"),
        ((2, 1, 3), "must rise"),
        ((1, 1, 2), "must rise"),
    ],
)
def test_receivers_that_cannot_be_the_enabled_ones_are_refused(numbers, message: str):
    with pytest.raises(InputError, match=f"enabled_receivers: {message}"):
        replace(PARAMETERS, enabled_receivers=numbers)


def test_a_raw_file_that_was_cut_off_says_what_is_missing_and_what_is_whole(tmp_path: Path):
    """A ramp is 3 receivers × 8 samples × 4 bytes = 96 bytes, a frame 576."""
    path = tmp_path / "walk.bin"
    write_raw(path, words(3, *SHAPE), device="xwr16xx", is_complex=True)
    path.write_bytes(path.read_bytes()[: 2 * 576 + 200])
    with pytest.raises(InputError) as caught:
        open_raw(path, PARAMETERS)
    message = str(caught.value)
    assert "walk.bin: 376 bytes are missing" in message
    assert "2 whole frames and the first 2 of frame 2's 6 ramps" in message
    assert "process frames 0 to 1, which are whole, with --frames 0-1" in message
    assert open_raw(path, PARAMETERS, frames=range(2)).num_frames == 2
    with pytest.raises(InputError, match="376 bytes are missing"):
        open_raw(path, PARAMETERS, frames=[2])


def test_fewer_whole_frames_than_there_should_be_are_refused(tmp_path: Path):
    path = tmp_path / "walk.bin"
    write_raw(path, words(1, *SHAPE), device="xwr16xx", is_complex=True)
    with pytest.raises(InputError, match=r"1152 bytes are missing.*1 whole frame; process frame 0"):
        open_raw(path, replace(PARAMETERS, num_frames=3))


def test_one_frame_that_was_cut_off_is_counted_as_one(tmp_path: Path):
    path = tmp_path / "walk.bin"
    path.write_bytes(b"1")
    with pytest.raises(InputError, match=r"1 frame of 6 ramps is 576 bytes, the file has 1; "):
        open_raw(path, PARAMETERS)


def test_an_empty_raw_file_has_nothing_to_process(tmp_path: Path):
    path = tmp_path / "walk.bin"
    path.write_bytes(b"")
    with pytest.raises(InputError, match=r"576 bytes are missing.*0 whole frames; record it again"):
        open_raw(path, PARAMETERS)
    with pytest.raises(InputError, match=r"576 bytes are missing.*0 whole frames; record it again"):
        open_raw(path, PARAMETERS, frames=[])
    with pytest.raises(InputError, match="there is no recording"):
        open_raw(tmp_path / "run.bin", PARAMETERS)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"device": None}, "name no device"),
        ({"num_samples": 7}, "must be even"),
        ({"num_receivers": 5}, "at most 4"),
    ],
)
def test_what_no_device_writes_is_refused(tmp_path: Path, changes, message: str):
    path = tmp_path / "walk.bin"
    path.write_bytes(bytes(576))
    with pytest.raises(InputError, match=message):
        open_raw(path, replace(PARAMETERS, **changes))


def test_a_sample_beyond_16_bits_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match="does not fit 16 bits"):
        write_raw(tmp_path / "x.bin", [np.full(SHAPE, 32768.0)], device="xwr16xx", is_complex=True)
