"""Chirps from files of TI's tools, written by hand in their formats, against values by hand."""

import copy
import json
from pathlib import Path

import pytest

from polychirp.bounded_text import MOST_BYTES
from polychirp.capture.ti_profile import read_profile
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError

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
