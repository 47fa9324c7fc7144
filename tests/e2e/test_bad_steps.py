"""Studies of MFSK that cannot run are refused in one sentence with its place, before they run."""

from pathlib import Path

import pytest

from polychirp.cli.app import main

GOOD = (Path(__file__).parents[2] / "studies" / "mfsk.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("verb", ["check", "run"])
@pytest.mark.parametrize(
    ("old", "new", "code", "sentence"),
    [
        (
            "num_sweeps = 1\n",
            "num_sweeps = 2\n",
            3,
            "radars.0.waveform: the receiver 'mfsk' needs one sweep",
        ),
        ('"4 us"', '"300 ns"', 3, "radars.0: the converter starts 0.3 µs after a step's start"),
        (
            'kind = "mfsk"',
            'kind = "mfsq"',
            2,
            "radars.0.waveform.kind: there is no 'mfsq'; did you mean 'mfsk'?",
        ),
        (
            '"-1.7578125 MHz"',
            '"0.5859375 MHz"',
            2,
            "radars.0.waveform: an MFSK waveform with a shift of half the increment",
        ),
        (
            "[receiver]",
            '[receiver]\nkind = "range-doppler"',
            3,
            "radars.0.waveform: its ramps are steps of constant frequency, from whose beats the "
            "receiver 'range-doppler' reads no range; the receivers 'auto' and 'mfsk' read",
        ),
        (
            "[receiver]",
            '[receiver]\nkind = "mfsk"',
            3,
            "radars.1.waveform: the receiver 'mfsk' needs steps of two sequences, and of this "
            "schedule its ramps are no steps of constant frequency; the receiver 'auto' chooses",
        ),
    ],
)
def test_a_study_of_steps_that_cannot_run_says_why(
    verb, old, new, code, sentence, tmp_path, capsys
):
    assert old in GOOD
    file = tmp_path / "mfsk.toml"
    file.write_text(GOOD.replace(old, new, 1), encoding="utf-8")
    assert main([verb, str(file)]) == code
    printed = capsys.readouterr().err
    assert sentence in " ".join(printed.split())
    assert "Traceback" not in printed
