"""Chirps from files of TI's tools, written by hand in their formats, against values by hand."""

import copy
import json
import struct
from pathlib import Path

import numpy as np
import pytest

from polychirp.bounded_text import MOST_BYTES
from polychirp.capture.dca1000 import open_raw
from polychirp.capture.ti_profile import read_profile, recording_parameters
from polychirp.capture.ti_stream import raw_parameters
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError, ModelWarning

STUDIO = {
    "configGenerator": {"createdBy": "mmWaveStudio", "isConfigIntermediate": 1},
    "currentVersion": {"jsonCfgVersion": {"major": 0, "minor": 4, "patch": 0}},
    "mmWaveDevices": [
        {
            "mmWaveDeviceId": 0,
            "rfConfig": {
                "waveformType": "legacyFrameChirp",
                "MIMOScheme": "TDM",
                "rlChanCfg_t": {"rxChannelEn": "0xF", "txChannelEn": "0x5", "cascading": 0},
                "rlAdcOutCfg_t": {
                    "fmt": {"b2AdcBits": 2, "b8FullScaleReducFctr": 0, "b2AdcOutFmt": 1}
                },
                "rlProfiles": [
                    {
                        "rlProfileCfg_t": {
                            "profileId": 0,
                            "pfVcoSelect": "0x0",
                            "startFreqConst_GHz": 77.0,
                            "idleTimeConst_usec": 10.0,
                            "adcStartTimeConst_usec": 6.0,
                            "rampEndTime_usec": 40.0,
                            "txOutPowerBackoffCode": "0x0",
                            "txPhaseShifter": "0x0",
                            "freqSlopeConst_MHz_usec": 30.0,
                            "txStartTime_usec": 0.0,
                            "numAdcSamples": 256,
                            "digOutSampleRate": 8000.0,
                            "hpfCornerFreq1": 0,
                            "hpfCornerFreq2": 0,
                            "rxGain_dB": "0x1E",
                        }
                    }
                ],
                "rlChirps": [
                    {
                        "rlChirpCfg_t": {
                            "chirpStartIdx": number,
                            "chirpEndIdx": number,
                            "profileId": 0,
                            "startFreqVar_MHz": 0.0,
                            "freqSlopeVar_KHz_usec": 0.0,
                            "idleTimeVar_usec": 0.0,
                            "adcStartTimeVar_usec": 0.0,
                            "txEnable": mask,
                        }
                    }
                    for number, mask in enumerate(["0x1", "0x4"])
                ],
                "rlFrameCfg_t": {
                    "chirpStartIdx": 0,
                    "chirpEndIdx": 1,
                    "numLoops": 64,
                    "numFrames": 8,
                    "framePeriodicity_msec": 40.0,
                },
                "rlBpmChirps": [],
                "rlRfPhaseShiftCfgs": [],
            },
        }
    ],
}
COMMANDS = """\
% the same chirps as commands of the mmWave SDK
sensorStop
flushCfg
dfeDataOutputMode 1
channelCfg 15 5 0
adcCfg 2 1
adcbufCfg -1 0 1 1 1
profileCfg 0 77 10 6 40 0 0 30 0 256 8000 0 0 30   # 0.03 GHz/us
chirpCfg 0 0 0 0 0 0 0 1
chirpCfg 1 1 0 0 0 0 0 4
frameCfg 0 1 64 0 40 1 0
guiMonitor -1 1 1 0 0 0 1
sensorStart
"""
DDM = """\
dfeDataOutputMode 1
channelCfg 15 15 0 0 0
adcCfg 2 0
profileCfg 0 77 7 7 20.81 0 0 8.883 0 256 30000 0 0 164
chirpCfg 0 5 0 0 0 0 0 15
frameCfg 0 5 128 0 256 50 1 0
ddmPhaseShiftAntOrder 0 2 3 1
"""


def read_commands(folder: Path, text: str):
    path = folder / "radar.cfg"
    path.write_text(text, encoding="utf-8")
    return read_profile(path)


def read_studio(folder: Path, data: object):
    path = folder / "radar.mmwave.json"
    path.write_text(json.dumps(data), encoding="utf-8")
    return read_profile(path)


def changed(path: str, value: object) -> dict:
    """The file of mmWave Studio with one value changed; a number in the path is that of a list."""
    out = copy.deepcopy(STUDIO)
    *parents, last = path.split("/")
    place = out["mmWaveDevices"][0]["rfConfig"]
    for key in parents:
        place = place[int(key) if key.isdecimal() else key]
    if value is None:
        del place[last]
    else:
        place[last] = value
    return out


def test_both_formats_give_the_same_chirps(tmp_path):
    assert read_commands(tmp_path, COMMANDS) == read_studio(tmp_path, STUDIO)


def test_what_the_chirps_resolve_is_what_the_file_says(tmp_path):
    """256 samples at 8 MS/s take 32 µs, in which 30 MHz/µs sweep 960 MHz.

    Complex 1x passes 0.9 · 8 MHz = 7.2 MHz, the beat of 7.2e6 c/60e12 = 36 m. Each of the two
    transmitters sends every 100 µs, about 77 GHz + 30 MHz/µs (6 + 16 - 1/16) µs = 77.658 GHz.
    """
    found = read_commands(tmp_path, COMMANDS)
    chirps = found.chirps
    assert chirps.range_resolution == pytest.approx(SPEED_OF_LIGHT / (2 * 960e6))
    assert chirps.greatest_range == pytest.approx(7.2e6 * SPEED_OF_LIGHT / 60e12)
    wavelength = SPEED_OF_LIGHT / 77.658125e9
    assert chirps.middle_frequency == pytest.approx(77.658125e9)
    assert chirps.speed_span == pytest.approx(wavelength / (2 * 100e-6))
    assert chirps.num_ramps == 128
    assert (found.transmitters, found.sharing, chirps.num_receivers) == ((1, 3), "time-division", 4)


def test_transmitters_take_turns_in_the_order_of_the_chirps(tmp_path):
    """TI's demos send with transmitters 1, 3 and 2."""
    text = COMMANDS.replace("channelCfg 15 5", "channelCfg 15 7").replace(
        "frameCfg 0 1", "frameCfg 0 2"
    )
    found = read_commands(tmp_path, text + "chirpCfg 2 2 0 0 0 0 0 2\n")
    assert found.transmitters == (1, 3, 2)
    assert found.chirps.num_transmitters == 3
    assert found.chirps.num_ramps == 192
    assert "transmitters 1, 3 and 2" in found.notes[0]


def test_doppler_division_has_a_band_for_each_chirp_of_a_loop(tmp_path):
    """The AWR2944's demo: real samples, of which 0.45 of the rate is passed; six bands."""
    found = read_commands(tmp_path, DDM)
    assert (found.sharing, found.num_bands) == ("doppler-division", 6)
    assert found.transmitters == (1, 3, 4, 2)
    assert found.chirps.sampling == "real"
    assert found.chirps.usable_beat == pytest.approx(13.5e6)
    assert found.chirps.num_ramps == 768


def test_two_transmitters_may_share_the_chirps_by_a_binary_code(tmp_path):
    text = COMMANDS.replace(" 0 0 0 0 1\n", " 0 0 0 0 5\n").replace(" 0 0 0 0 4\n", " 0 0 0 0 5\n")
    assert read_commands(tmp_path, text).sharing == "together"
    assert read_commands(tmp_path, text + "bpmCfg -1 1 0 1\n").sharing == "phase-coded"
    assert read_commands(tmp_path, text + "bpmCfg -1 0 0 1\n").sharing == "together"


@pytest.mark.parametrize(("code", "bits"), [(0, 12), (1, 14), (2, 16)])
def test_the_number_of_bits_is_read(tmp_path, code, bits):
    found = read_commands(tmp_path, COMMANDS.replace("adcCfg 2 1", f"adcCfg {code} 1"))
    assert found.chirps.adc_bits == bits
    assert found.chirps.stored_full_scale == 2 ** (bits - 1)


def test_phases_that_turn_a_beam_are_told(tmp_path):
    """Transmitter 3 by half a turn, 32 steps of 5.625° from bit 18 on; both alike turn nothing."""
    text = COMMANDS.replace(" 0 0 0 0 1\n", " 0 0 0 0 5\n").replace(" 0 0 0 0 4\n", " 0 0 0 0 5\n")
    assert not any("txPhaseShifter" in note for note in read_commands(tmp_path, text).notes)
    for phases, is_turned in ((32 << 18, True), (32 << 10, False), (32 << 18 | 32 << 2, False)):
        turned = text.replace("6 40 0 0 30", f"6 40 0 {phases} 30")
        assert turned != text
        notes = read_commands(tmp_path, turned).notes
        assert any("txPhaseShifter" in note for note in notes) == is_turned


def test_variations_of_a_chirp_are_added_to_its_profile(tmp_path):
    """50 MHz, which the command has in Hz; 100 kHz/µs; 3 and 1 µs."""
    text = COMMANDS.replace("0 0 0 0 0 1\n", "0 5e7 100 3 1 1\n").replace(
        "0 0 0 0 0 4\n", "0 5e7 100 3 1 4\n"
    )
    chirps = read_commands(tmp_path, text).chirps
    assert chirps.start_frequency == pytest.approx(77.05e9)
    assert chirps.slope == pytest.approx(30.1e12)
    assert chirps.idle_time == pytest.approx(13e-6)
    assert chirps.adc_start == pytest.approx(7e-6)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("profileCfg", "#profileCfg", "profileId: the file lacks the profile 0 of chirp 0"),
        ("frameCfg 0 1 64", "frameCfg 0 1 0", "numLoops"),
        ("frameCfg 0 1 64", "frameCfg 0 2 64", "chirp 2 is in the frame, but no chirpCfg"),
        ("frameCfg 0 1 64", "frameCfg 0 600 64", "no chirps of a device"),
        ("frameCfg 0 1 64", "frameCfg 1 0 64", "no chirps of a device"),
        ("frameCfg 0 1 64 0 40 1 0", "", "frameCfg: is missing"),
        ("frameCfg 0 1 64 0 40 1 0", "frameCfg 0", "frameCfg: chirpEndIdx is missing"),
        ("profileCfg 0 77", "profileCfg 0 abc", "line 8, profileCfg: 'abc' is not a number"),
        ("profileCfg 0 77", "profileCfg 0 nan", "'nan' is not a number"),
        ("profileCfg 0 77", "profileCfg 0 1e999", "too large a number"),
        ("profileCfg 0 77", "profileCfg 0 77000", "startFreq: 7.7e\\+13 of chirp 0 is outside"),
        ("256 8000 0 0 30", "", "numAdcSamples is missing"),
        ("256 8000", "2560 8000", "ramp_end_time: the converter's last sample"),
        ("256 8000", "25.6 8000", "numAdcSamples: 25.6 is not a whole number"),
        ("256 8000", "256 -8000", "digOutSampleRate"),
        (" 0 0 0 0 4\n", " 0 0 5 0 4\n", "idleTime: the chirps 0 and 1 of a loop differ"),
        (" 0 0 0 0 4\n", " 0 0 0 0 2\n", "txEnable: chirp 1 is sent by a transmitter"),
        (" 0 0 0 0 4\n", " 0 0 0 0 0\n", "txEnable of chirp 1: 0 is not"),
        (" 0 0 0 0 4\n", " 0 0 0 0 5\n", "neither take turns"),
        ("channelCfg 15 5", "channelCfg 11 5", "rxChannelEn: 0xb"),
        ("channelCfg 15 5", "channelCfg 0 5", "rxChannelEn"),
        ("adcCfg 2 1", "adcCfg 3 1", "numADCBits: 3 is not supported"),
        ("adcCfg 2 1", "adcCfg 2 3", "adcOutputFmt: 3 is not supported"),
        ("adcCfg 2 1", "adcCfg 2", "adcCfg: adcOutputFmt is missing"),
        ("dfeDataOutputMode 1", "dfeDataOutputMode 3", "dfeDataOutputMode: only frames"),
    ],
)
def test_commands_that_cannot_be_used_are_refused_with_their_place(tmp_path, old, new, message):
    assert old in COMMANDS
    with pytest.raises(InputError, match=message) as error:
        read_commands(tmp_path, COMMANDS.replace(old, new))
    assert str(error.value).startswith("radar.cfg: ")


PROFILE = "rlProfiles/0/rlProfileCfg_t"


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (f"{PROFILE}/numAdcSamples", None, "rlProfileCfg_t.numAdcSamples: is missing"),
        (f"{PROFILE}/numAdcSamples", [256], "is not a number"),
        (f"{PROFILE}/numAdcSamples", True, "True is not a number"),
        (f"{PROFILE}/numAdcSamples", "0x" + 5000 * "F", "is not a number"),
        (f"{PROFILE}/startFreqConst_GHz", 1e300, "too large a number"),
        ("rlProfiles", {}, "rlProfiles: must be a list"),
        ("rlProfiles", [[]], "rlProfiles.0.: must be a JSON object"),
        ("rlChirps", 5000 * [0], "rlChirps: has 5000 entries"),
        ("rlFrameCfg_t", None, "rlFrameCfg_t: is missing"),
        ("rlFrameCfg_t/chirpEndIdx", -1, "rlFrameCfg_t.chirpEndIdx: -1 is not a whole number"),
        ("waveformType", "advancedFrameChirp", "waveformType: 'advancedFrameChirp'"),
        ("rlBpmChirps", [{"rlBpmChirpCfg_t": {"constBpmVal": "0x2"}}], "codes that change"),
        ("rlDynChirpCfgs", [{}], "rlDynChirpCfgs: codes that change"),
    ],
)
def test_a_studio_file_that_cannot_be_used_is_refused_with_its_place(
    tmp_path, path, value, message
):
    with pytest.raises(InputError, match=message):
        read_studio(tmp_path, changed(path, value))


def test_codes_of_zero_phase_are_no_codes(tmp_path):
    codes = [{"rlBpmChirpCfg_t": {"isConfigured": 1, "chirpStartIdx": 1, "constBpmVal": "0x0"}}]
    assert read_studio(tmp_path, changed("rlBpmChirps", codes)) == read_studio(tmp_path, STUDIO)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("radar.cfg", b"\xff\xfe", "not text in UTF-8"),
        ("radar.json", b"{", "is not JSON"),
        ("radar.json", b"[]", "the file: must be a JSON object"),
        ("radar.json", 10_000 * b"[", "nested"),
        ("radar.json", b'{"mmWaveDevices": [{}, {}]}', "must list one device"),
        ("radar.txt", b"", "must end in .json"),
        ("radar.cfg", (MOST_BYTES + 1) * b"%", "larger than 16 MiB"),
        ("radar.cfg", b"adcCfg" + 100_000 * b" 1", "line 1, adcCfg: has 100000 values"),
        ("radar.cfg", 3000 * b"chirpCfg 0 0 0 0 0 0 0 1\n", "more than 2048 commands"),
    ],
)
def test_files_of_another_kind_are_refused_in_one_sentence(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=message) as error:
        read_profile(path)
    assert "\n" not in str(error.value)


def test_a_missing_file_is_said_to_be_missing(tmp_path):
    with pytest.raises(InputError, match=r"nix\.cfg: this profile does not exist"):
        read_profile(tmp_path / "nix.cfg")


# ── layout of the recordings ──────────────────────────────────────────────────

RAMPS, SAMPLES = 4, 2


def sample(receiver: int, ramp: int, fast: int) -> tuple[int, int]:
    """I and Q of a sample, which no other sample has."""
    return 1000 * receiver + 100 * ramp + 10 * fast + 1, -(1000 * receiver + 100 * ramp + fast + 5)


def frame_of(*receivers: int) -> np.ndarray:
    """Samples ``(receiver, ramp, fast)`` that a recording of these receivers should have."""
    return np.array(
        [
            [[complex(*sample(n, ramp, fast)) for fast in range(SAMPLES)] for ramp in range(RAMPS)]
            for n in receivers
        ]
    )


def on_two_lanes(*receivers: int, q_first: bool = False, is_real: bool = False) -> bytes:
    """SWRA581: I0 I1 Q0 Q1 of a receiver, then the next one; Q0 Q1 I0 I1 if Q is sent first."""
    words = []
    for ramp in range(RAMPS):
        for n in receivers:
            (i0, q0), (i1, q1) = sample(n, ramp, 0), sample(n, ramp, 1)
            if is_real:
                words += [i0, i1]
            elif q_first:
                words += [q0, q1, i0, i1]
            else:
                words += [i0, i1, q0, q1]
    return struct.pack(f"<{len(words)}h", *words)


def on_four_lanes(*receivers: int, q_first: bool = False) -> bytes:
    """SWRA581: I of the four receivers, then Q of the four; those that are off send zeros."""
    words = []
    for ramp in range(RAMPS):
        for fast in range(SAMPLES):
            on = {n: sample(n, ramp, fast) for n in receivers}
            i = [on[n][0] if n in on else 0 for n in (0, 1, 2, 3)]
            q = [on[n][1] if n in on else 0 for n in (0, 1, 2, 3)]
            words += q + i if q_first else i + q
    return struct.pack(f"<{len(words)}h", *words)


def studio_recording(*, receivers: str, lanes: str, interleave: int, swap: int) -> dict:
    """The file of mmWave Studio with short ramps and the format of the recording."""
    data = changed("rlChanCfg_t/rxChannelEn", receivers)
    device = data["mmWaveDevices"][0]
    device["rfConfig"]["rlProfiles"][0]["rlProfileCfg_t"]["numAdcSamples"] = SAMPLES
    device["rfConfig"]["rlFrameCfg_t"]["numLoops"] = RAMPS // 2
    device["rawDataCaptureConfig"] = {
        "rlDevDataFmtCfg_t": {"iqSwapSel": swap, "chInterleave": interleave},
        "rlDevDataPathCfg_t": {"intfSel": 1, "transferFmtPkt0": "0x1", "transferFmtPkt1": "0x0"},
        "rlDevLaneEnable_t": {"laneEn": lanes},
        "rlDevLvdsLaneCfg_t": {"laneFmtMap": 0, "laneParamCfg": "0x1"},
    }
    return data


TWO_LANES = {"receivers": "0xF", "lanes": "0x3", "interleave": 1, "swap": 0}
SHORT = COMMANDS.replace("256 8000", f"{SAMPLES} 8000").replace("0 1 64", f"0 1 {RAMPS // 2}")


def raw_of(folder: Path, profile: object, device=None):
    """Parameters of a raw file from a profile: text of commands, or a file of mmWave Studio."""
    if isinstance(profile, str):
        path = folder / "radar.cfg"
        path.write_text(profile, encoding="utf-8")
    else:
        path = folder / "radar.mmwave.json"
        path.write_text(json.dumps(profile), encoding="utf-8")
    return raw_parameters(path, device=device)


def samples_of(folder: Path, content: bytes, parameters) -> np.ndarray:
    """Samples of the only frame of a raw file, in units of its words."""
    (folder / "walk.bin").write_bytes(content)
    recording = open_raw(folder / "walk.bin", parameters)
    assert recording.num_frames == 1
    return recording.frame(0).samples * parameters.stored_full_scale


@pytest.mark.parametrize("swap", [0, 1])
def test_the_order_of_i_and_q_is_that_of_the_profile(tmp_path, swap):
    """The conjugate of Q + jI is -j (I + jQ): all phases are 90 degrees too small, alike."""
    turn = -1j if swap else 1
    expected = turn * frame_of(0, 1, 2, 3)
    content = on_two_lanes(0, 1, 2, 3, q_first=swap == 1)
    studio = studio_recording(**{**TWO_LANES, "swap": swap})
    commands = SHORT.replace("adcbufCfg -1 0 1 1 1", f"adcbufCfg -1 0 {swap} 1 1")
    for profile in (studio, commands):
        parameters = raw_of(tmp_path, profile, device="xwr16xx")
        np.testing.assert_array_equal(samples_of(tmp_path, content, parameters), expected)


def test_a_profile_without_a_format_says_nothing_on_the_order(tmp_path):
    commands = SHORT.replace("adcbufCfg -1 0 1 1 1\n", "")
    parameters = raw_of(tmp_path, commands, device="xwr16xx")
    found = samples_of(tmp_path, on_two_lanes(0, 1, 2, 3), parameters)
    np.testing.assert_array_equal(found, frame_of(0, 1, 2, 3))


@pytest.mark.parametrize(
    ("mask", "receivers"), [("0xF", (0, 1, 2, 3)), ("0xC", (2, 3)), ("0x6", (1, 2)), ("0x8", (3,))]
)
@pytest.mark.parametrize("swap", [0, 1])
def test_receivers_are_read_from_their_lanes(tmp_path, mask, receivers, swap):
    """On four lanes each receiver has its own; on two lanes those that are on follow each other."""
    expected = (-1j if swap else 1) * frame_of(*receivers)
    for lanes, interleave, content in (
        ("0xF", 0, on_four_lanes(*receivers, q_first=swap == 1)),
        ("0x3", 1, on_two_lanes(*receivers, q_first=swap == 1)),
    ):
        studio = studio_recording(receivers=mask, lanes=lanes, interleave=interleave, swap=swap)
        found = samples_of(tmp_path, content, raw_of(tmp_path, studio))
        np.testing.assert_array_equal(found, expected)


def test_commands_read_the_lanes_of_the_device_that_is_given(tmp_path):
    """The first SDKs, those of the xWR14xx, write adcbufCfg without subFrameIdx."""
    commands = SHORT.replace("channelCfg 15", "channelCfg 12").replace(
        "adcbufCfg -1 0 1 1 1", "adcbufCfg 0 1 0 1"
    )
    parameters = raw_of(tmp_path, commands, device="xwr14xx")
    found = samples_of(tmp_path, on_four_lanes(2, 3, q_first=True), parameters)
    np.testing.assert_array_equal(found, -1j * frame_of(2, 3))


def test_real_samples_have_no_order_of_i_and_q(tmp_path):
    """Real samples are doubled, for the half of their amplitude at the negative frequency."""
    studio = studio_recording(**{**TWO_LANES, "swap": 1})
    studio["mmWaveDevices"][0]["rfConfig"]["rlAdcOutCfg_t"]["fmt"]["b2AdcOutFmt"] = 0
    parameters = raw_of(tmp_path, studio)
    found = samples_of(tmp_path, on_two_lanes(0, 1, 2, 3, is_real=True), parameters)
    np.testing.assert_array_equal(found, 2 * frame_of(0, 1, 2, 3).real)


@pytest.mark.parametrize(
    ("section", "key", "value", "message"),
    [
        ("rlDevDataFmtCfg_t", "iqSwapSel", 2, "iqSwapSel: with 2 .* record with 0 or 1"),
        ("rlDevDataFmtCfg_t", "iqSwapSel", "Q", "iqSwapSel: 'Q' is not a number"),
        ("rlDevDataFmtCfg_t", "chInterleave", 0, "chInterleave: 0 sends the receivers sample by"),
        ("rlDevLaneEnable_t", "laneEn", "0x1", "laneEn: with 0x1 .* record with 0x3 or 0xf"),
        ("rlDevLaneEnable_t", "laneEn", "0xF", "laneEn: 0xf are 4 lanes, but xwr16xx sends on 2"),
        ("rlDevDataPathCfg_t", "intfSel", 0, "intfSel: with 0 .* record with 1"),
        ("rlDevDataPathCfg_t", "transferFmtPkt0", "0x6", "transferFmtPkt0: with 6 .* more than"),
        ("rlDevDataPathCfg_t", "transferFmtPkt1", "0xE", "transferFmtPkt1: with 14 .* more than"),
        ("rlDevLvdsLaneCfg_t", "laneFmtMap", 1, "laneFmtMap: with 1 .* in reverse order"),
    ],
)
def test_a_studio_format_that_is_not_read_is_refused_with_its_field(
    tmp_path, section, key, value, message
):
    """Only for raw files: arrays and studies do not depend on the lanes."""
    studio = studio_recording(**TWO_LANES)
    studio["mmWaveDevices"][0]["rawDataCaptureConfig"][section][key] = value
    with pytest.raises(InputError, match=message) as error:
        raw_of(tmp_path, studio, device="xwr16xx")
    assert str(error.value).startswith("radar.mmwave.json: rlDev")
    if value != "Q":
        assert recording_parameters(tmp_path / "radar.mmwave.json").num_receivers == 4


@pytest.mark.parametrize("config", [[], {"rlDevLaneEnable_t": 3}])
def test_a_studio_format_that_is_no_object_is_refused(tmp_path, config):
    studio = studio_recording(**TWO_LANES)
    studio["mmWaveDevices"][0]["rawDataCaptureConfig"] = config
    with pytest.raises(InputError, match=r"rawDataCaptureConfig.*: must be a JSON object"):
        raw_of(tmp_path, studio)


def test_sections_that_studio_did_not_set_up_are_not_read(tmp_path):
    """Studio writes a laneEn of 0 for them."""
    studio = studio_recording(**TWO_LANES)
    off = {"laneEn": "0x0", "isConfigured": 0}
    studio["mmWaveDevices"][0]["rawDataCaptureConfig"]["rlDevLaneEnable_t"] = off
    assert raw_of(tmp_path, studio).device is None
    assert raw_of(tmp_path, studio, device="xwr18xx").device == "xwr18xx"


@pytest.mark.parametrize(
    ("old", "new", "device", "message"),
    [
        ("-1 0 1 1 1", "-1 1 1 1 1", "xwr16xx", "adcOutputFmt: 1 are real samples"),
        ("-1 0 1 1 1", "-1 0 1 0 1", "xwr16xx", "ChanInterleave: 0 sends .* sample by sample"),
        ("-1 0 1 1 1", "-1 0 1 1 1", "xwr14xx", "ChanInterleave: 1 sends .* one after the other"),
        ("-1 0 1 1 1", "-1 0 1 1 2", "xwr16xx", "ChirpThreshold: with 2 .* several ramps"),
        ("-1 0 1 1 1", "-1 0 1", "xwr16xx", "adcbufCfg: has 3 values; write subFrameIdx, adcOutp"),
        ("sensorStart", "lvdsStreamCfg -1 1 1 0", "xwr16xx", "enableHeader: with 1 .* headers"),
        ("sensorStart", "lvdsStreamCfg -1 0 4 0", "xwr16xx", "dataFmt: with 4 .* record with 1$"),
        ("sensorStart", "lvdsStreamCfg -1 0 1 1", "xwr16xx", "enableSW: with 1 .* results of"),
    ],
)
def test_commands_of_a_format_that_is_not_read_are_refused(tmp_path, old, new, device, message):
    assert SHORT.count(old) == 1
    with pytest.raises(InputError, match=message) as error:
        raw_of(tmp_path, SHORT.replace(old, new), device=device)
    assert str(error.value).startswith("radar.cfg: ")


def test_commands_that_stream_the_samples_alone_are_read(tmp_path):
    parameters = raw_of(tmp_path, SHORT + "lvdsStreamCfg -1 0 1 0\n", device="xwr16xx")
    assert parameters == raw_of(tmp_path, SHORT, device="xwr16xx")


def test_commands_that_send_no_samples_are_told(tmp_path):
    with pytest.warns(ModelWarning, match="dataFmt: 0 sends no samples to the card"):
        raw_of(tmp_path, SHORT + "lvdsStreamCfg -1 0 0 0\n", device="xwr16xx")


def test_three_receivers_on_two_lanes_are_told(tmp_path):
    commands = SHORT.replace("channelCfg 15", "channelCfg 7")
    with pytest.warns(ModelWarning, match="rxChannelEn: 0x7 switches three receivers on"):
        raw_of(tmp_path, commands, device="xwr16xx")


def test_receivers_that_no_device_has_are_refused(tmp_path):
    commands = SHORT.replace("channelCfg 15", "channelCfg 48")
    parameters = raw_of(tmp_path, commands, device="xwr16xx")
    with pytest.raises(InputError, match="enabled_receivers: a device has the receivers 0 to 3"):
        samples_of(tmp_path, on_two_lanes(0, 1), parameters)
