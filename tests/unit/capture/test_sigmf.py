"""SigMF: what is written is what is read, to the bit; and one sentence for every mistake."""

import hashlib
import json

import numpy as np
import pytest

from polychirp.capture.sigmf import FORMATS, check_sha512, open_sigmf, write_sigmf
from polychirp.errors import InputError
from polychirp.model.baseband import Baseband, SampleSource
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular

PLAN = DiverseTriangular(
    start_frequency=3.95e9, bandwidth=(80e6, 100e6), ramp_duration=(5e-6, 10e-6)
).schedule(num_sweeps=2, streams=Streams(seed=1))


def signal(samples, **fields):
    return Baseband(samples=samples, sample_rate=130e6, centre_frequency=4e9, **fields)


def noise(count=1000, scale=0.2):
    draw = np.random.default_rng(1).standard_normal((count, 2)) * scale
    return draw.view(complex)[:, 0]


@pytest.fixture
def recording(tmp_path):
    """The path of a recording of a thousand samples, with its ramps."""
    return write_sigmf(tmp_path / "walk", signal(noise()), datatype="ci16_le", schedule=PLAN)


def changed(path, **changes):
    """The same metadata with some global fields changed, or removed where they are None."""
    metadata = json.loads(path.read_text())
    for key, value in changes.items():
        name = key.replace("__", ":")
        metadata["global"].pop(name, None)
        if value is not None:
            metadata["global"][name] = value
    path.write_text(json.dumps(metadata))


def test_floats_come_back_bit_by_bit(tmp_path):
    words = np.random.default_rng(1).standard_normal(2000).astype(np.float32)
    words[:2] = np.float32(1e-42), np.float32(-0.0)  # a number below the normal ones, and a sign
    path = write_sigmf(tmp_path / "walk", signal(words.astype(float).view(complex)))
    assert path.with_suffix(".sigmf-data").read_bytes() == words.astype("<f4").tobytes()
    back = open_sigmf(path).signal()
    np.testing.assert_array_equal(back.samples.view(float), words.astype(float))


def test_integers_come_back_bit_by_bit(tmp_path):
    """Every value that 16 bits have."""
    words = np.arange(-(2**15), 2**15, dtype=np.int16)
    path = write_sigmf(tmp_path / "a", signal(noise(words.size // 2)), datatype="ci16_le")
    data = path.with_suffix(".sigmf-data")
    data.write_bytes(words.astype("<i2").tobytes())
    back = open_sigmf(path).signal()
    assert back.samples.real.min() == -1.0
    again = write_sigmf(tmp_path / "b", back, datatype="ci16_le")
    assert again.with_suffix(".sigmf-data").read_bytes() == data.read_bytes()


@pytest.mark.parametrize("datatype", sorted(FORMATS))
def test_every_type_is_read_as_parts_of_full_scale(tmp_path, datatype):
    path = write_sigmf(tmp_path / "walk", signal(noise(2)))
    kind, zero, full = FORMATS[datatype]
    values = np.array([0.0, 0.5, -0.5, -1.0])
    words = (values * full + zero).astype(kind)
    path.with_suffix(".sigmf-data").write_bytes(words.tobytes())
    changed(path, core__datatype=datatype, core__sha512=None)
    np.testing.assert_array_equal(open_sigmf(path).signal().samples.view(float), values)


def test_metadata_come_back(recording):
    found = open_sigmf(recording)
    assert isinstance(found, SampleSource)
    assert (found.sample_rate, found.centre_frequency, found.num_samples) == (130e6, 4e9, 1000)
    for name in ("start_time", "duration", "start_frequency", "slope", "start_phase", "sweep"):
        np.testing.assert_array_equal(getattr(found.schedule, name), getattr(PLAN, name))
    check_sha512(found)


def test_metadata_are_what_the_format_asks_for(recording):
    metadata = json.loads(recording.read_text())
    assert set(metadata) == {"global", "captures", "annotations"}
    fields = metadata["global"]
    data = recording.with_suffix(".sigmf-data").read_bytes()
    assert fields["core:sha512"] == hashlib.sha512(data).hexdigest()
    assert fields["core:datatype"] == "ci16_le"
    assert fields["core:extensions"] == [
        {"name": "polychirp", "version": "0.1.0", "optional": True}
    ]
    assert metadata["captures"] == [{"core:sample_start": 0, "core:frequency": 4e9}]
    names = {name.partition(":")[0] for name in fields}
    assert names == {"core", "polychirp"}


def test_the_sigmf_package_accepts_what_is_written(recording):
    sigmf = pytest.importorskip("sigmf", reason="the package sigmf is not installed")
    found = sigmf.fromfile(str(recording))
    found.validate()
    np.testing.assert_array_equal(
        np.asarray(found.read_samples(), dtype=np.complex128),
        open_sigmf(recording).signal().samples,
    )


def test_equal_signals_give_equal_files(tmp_path):
    paths = [write_sigmf(tmp_path / name / "walk", signal(noise())) for name in "ab"]
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_pieces_are_the_whole(recording):
    found = open_sigmf(recording)
    pieces = np.concatenate([found.read(0, 333), found.read(333, 1000)])
    np.testing.assert_array_equal(pieces, found.signal().samples)


def test_the_start_is_kept(tmp_path):
    path = write_sigmf(tmp_path / "late", signal(noise(), start_time=1.5e-6))
    assert open_sigmf(path).signal().start_time == 1.5e-6


# ── mistakes ──────────────────────────────────────────────────────────────────


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"core__datatype": None}, "core:datatype is missing; give it, as in 'cf32_le'"),
        ({"core__datatype": "rf32_le"}, "'rf32_le' is real, but I and Q are needed"),
        ({"core__datatype": "cx9"}, "'cx9' is unknown; known are"),
        ({"core__sample_rate": None}, "core:sample_rate is missing"),
        ({"core__sample_rate": "130 MS/s"}, "core:sample_rate is '130 MS/s'; it must be a number"),
        ({"core__sample_rate": -1.0}, "core:sample_rate is -1; give the samples per second"),
        ({"core__num_channels": 2}, "has 2 channels; store each"),
        ({"core__datatype": "cf32_le"}, "was cut off: 500 of 1000 samples are there"),
        ({"core__datatype": "ci8"}, "are not 1000 samples of 2 bytes (ci8)"),
        ({"polychirp__schedule": {"slope": [1.0]}}, "polychirp:schedule needs lists of numbers"),
        ({"core__sha512": "00"}, "its SHA-512 is not the one in its metadata"),
    ],
)
def test_wrong_metadata_are_one_sentence(recording, changes, sentence):
    changed(recording, **changes)
    with pytest.raises(InputError) as raised:
        check_sha512(open_sigmf(recording))
    assert sentence in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("left", [3999, 3000, 2])
def test_a_file_that_was_cut_off_is_refused_with_what_is_left(recording, left):
    data = recording.with_suffix(".sigmf-data")
    data.write_bytes(data.read_bytes()[:left])
    with pytest.raises(InputError, match=rf"was cut off: {left // 4} of 1000 samples are there"):
        open_sigmf(recording)


def test_a_cut_within_a_sample_is_seen_without_our_namespace(recording):
    changed(recording, polychirp__num_samples=None)
    data = recording.with_suffix(".sigmf-data")
    data.write_bytes(data.read_bytes()[:-1])
    with pytest.raises(InputError, match="are not whole samples of 4 bytes"):
        open_sigmf(recording)


def test_one_changed_bit_is_seen(recording):
    data = recording.with_suffix(".sigmf-data")
    content = bytearray(data.read_bytes())
    content[1234] ^= 1
    data.write_bytes(content)
    with pytest.raises(InputError, match="the samples were changed or belong to another"):
        check_sha512(open_sigmf(recording))


def test_integers_labelled_as_floats_are_refused_when_they_are_no_numbers(tmp_path):
    path = write_sigmf(tmp_path / "walk", signal(noise(2)))
    path.with_suffix(".sigmf-data").write_bytes(np.full(8, -1, dtype="<i2").tobytes())
    changed(path, core__sha512=None)
    with pytest.raises(InputError, match="but the samples may be integers"):
        open_sigmf(path).signal()


def test_ramps_of_another_band_are_a_wrong_label(recording):
    metadata = json.loads(recording.read_text())
    metadata["captures"][0]["core:frequency"] = 3.75e9
    recording.write_text(json.dumps(metadata))
    with pytest.raises(InputError, match=r"core:frequency is 3.75 GHz .* correct the wrong one"):
        open_sigmf(recording)


@pytest.mark.parametrize(
    ("captures", "sentence"),
    [
        (None, "has no list 'captures'"),
        ([{"core:frequency": 1e9}, {"core:frequency": 2e9}], "was retuned while recording"),
        ([{"core:header_bytes": 8}], "has headers between samples"),
    ],
)
def test_wrong_captures_are_one_sentence(recording, captures, sentence):
    metadata = json.loads(recording.read_text())
    metadata["captures"] = captures
    recording.write_text(json.dumps(metadata))
    with pytest.raises(InputError, match=sentence):
        open_sigmf(recording)


def test_what_is_not_there_or_no_sigmf_is_said(tmp_path, recording):
    with pytest.raises(InputError, match="there is no recording"):
        open_sigmf(tmp_path / "none.sigmf-meta")
    with pytest.raises(InputError, match="is no SigMF recording; name its file"):
        open_sigmf(tmp_path / "walk.npy")
    recording.with_suffix(".sigmf-data").unlink()
    with pytest.raises(InputError, match="there are no samples"):
        open_sigmf(recording)
    for text, sentence in (("{", "is not JSON"), ("[]", "is not an object"), ("{}", "no object")):
        recording.write_text(text)
        with pytest.raises(InputError, match=sentence):
            open_sigmf(recording)


def test_samples_beyond_full_scale_are_not_clipped_in_silence(tmp_path):
    with pytest.raises(InputError, match="scale the signal down, or write cf32_le"):
        write_sigmf(tmp_path / "loud", signal(np.array([1.0 + 0j])), datatype="ci16_le")
