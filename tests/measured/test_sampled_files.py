"""femgear.measured.sampled_files: WAV and MATLAB files of SciPy, h5py and femgear come back."""

import struct
import wave

import h5py
import numpy as np
import pytest
from scipy.io import savemat, wavfile

from femgear.errors import CaseError
from femgear.exchange.formats import Signal, write_wav
from femgear.measured.sampled_files import read_matlab_signals, read_wav_signals

VALUES = np.random.default_rng(2).uniform(-0.9, 0.9, size=(500, 2))


@pytest.mark.parametrize(
    ("kind", "scale", "offset", "step"),
    [("uint8", 128, 128, 2e-2), ("int16", 2**15, 0, 1e-4), ("int32", 2**31, 0, 1e-9), ("float32", 1, 0, 1e-7)],
)
def test_wav_of_all_kinds(kind, scale, offset, step, tmp_path):
    wavfile.write(tmp_path / "a.wav", 25600, (VALUES * scale + offset).astype(kind))
    channels = read_wav_signals(tmp_path / "a.wav")
    assert [one.name for one in channels] == ["channel 1", "channel 2"] and channels[0].rate == 25600
    assert np.abs(channels[1].values - VALUES[:, 1]).max() < step


def test_wav_of_femgear_has_its_unit(tmp_path):
    write_wav(Signal("near", "m/s^2", 48000, 300 * VALUES[:, 0]), tmp_path / "a.wav", full_scale=400.0)
    (channel,) = read_wav_signals(tmp_path / "a.wav")
    assert channel.unit == "m/s^2" and np.allclose(channel.values, 300 * VALUES[:, 0], atol=1e-4)


@pytest.mark.parametrize("version", ["4", "5", "7.3"])
def test_matlab_of_all_versions(version, tmp_path):
    path, data = tmp_path / "a.mat", {"acc": VALUES[:, 0], "X097_DE_time": VALUES[:, 1], "fs": 12000.0}
    if version == "7.3":
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, value in data.items():
                file[name] = np.atleast_2d(value)
        with open(path, "r+b") as stream:
            stream.write(b"MATLAB 7.3 MAT-file")
    else:
        savemat(path, data, format=version)
    found = {one.name: one for one in read_matlab_signals(path)}
    assert set(found) == {"acc", "X097_DE_time"} and found["acc"].rate == 12000.0
    assert np.array_equal(found["acc"].values, VALUES[:, 0])


def test_matlab_structs_matrices_and_times(tmp_path):
    time = np.arange(500) / 20000.0
    savemat(tmp_path / "a.mat", {"test": {"Time": time, "signals": VALUES, "note": "text"}, "n": 3})
    channels = read_matlab_signals(tmp_path / "a.mat")
    assert [one.name for one in channels] == ["test.signals 1", "test.signals 2"]
    assert channels[0].rate == pytest.approx(20000.0)
    assert np.array_equal(channels[1].values, VALUES[:, 1])


def hostile_matlab(tmp_path, kind):
    path = tmp_path / "a.mat"
    if kind == "numbers alone":
        savemat(path, {"a": 1.0, "b": np.arange(5)})
    elif kind == "no rate":
        savemat(path, {"acc": VALUES})
    else:
        savemat(path, {"acc": VALUES, "fs": 1e3})
        path.write_bytes(path.read_bytes()[:2000] if kind == "broken off" else b"\x01garbage" * 40)
    return path


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("numbers alone", "no signals"),
        ("no rate", "how many samples a second"),
        ("broken off", "no MATLAB file"),
        ("garbage", "no MATLAB file"),
    ],
)
def test_matlab_files_that_are_refused(kind, words, tmp_path):
    with pytest.raises(CaseError, match=words) as refused:
        read_matlab_signals(hostile_matlab(tmp_path, kind))
    assert refused.value.code == "E-FILE" and refused.value.remedy


@pytest.mark.parametrize("length", [3, 20, 60, 900])
def test_wav_files_that_are_broken_off_are_refused(length, tmp_path):
    wavfile.write(tmp_path / "a.wav", 25600, VALUES.astype(np.float32))
    data = (tmp_path / "a.wav").read_bytes()
    (tmp_path / "a.wav").write_bytes(data[:length])
    with pytest.raises(CaseError, match=r"broken off|no WAV file") as refused:
        read_wav_signals(tmp_path / "a.wav")
    assert refused.value.code == "E-FILE" and refused.value.remedy


@pytest.mark.parametrize(("bits", "channels"), [(16, 1), (24, 1), (24, 2), (32, 2)])
def test_wav_files_that_end_within_a_sample_are_called_broken_off(bits, channels, tmp_path):
    with wave.open(str(tmp_path / "a.wav"), "wb") as stream:
        stream.setparams((channels, bits // 8, 25600, 0, "NONE", ""))
        stream.writeframes(bytes(bits // 8 * channels * 500))
    data = (tmp_path / "a.wav").read_bytes()
    for lost in range(1, 9):
        (tmp_path / "a.wav").write_bytes(data[:-lost])
        with pytest.raises(CaseError, match="the file is broken off"):
            read_wav_signals(tmp_path / "a.wav")


@pytest.mark.parametrize("extensible", [False, True])
def test_wav_files_of_24_bits_come_back(extensible, tmp_path):
    """The format WAVE_FORMAT_EXTENSIBLE names PCM by its GUID, as recorders of 24 bits do."""
    samples = np.round(0.8 * VALUES[:, 0] / np.abs(VALUES[:, 0]).max() * 2**23).astype("<i4")
    data = samples.view(np.uint8).reshape(-1, 4)[:, :3].tobytes()
    head = struct.pack("<HHIIHH", 0xFFFE if extensible else 1, 1, 25600, 3 * 25600, 3, 24)
    head += struct.pack("<HHI", 22, 24, 4) + bytes.fromhex("0100000000001000800000aa00389b71") if extensible else b""
    body = b"WAVEfmt " + struct.pack("<I", len(head)) + head + b"data" + struct.pack("<I", len(data)) + data
    (tmp_path / "a.wav").write_bytes(b"RIFF" + struct.pack("<I", len(body)) + body)
    (channel,) = read_wav_signals(tmp_path / "a.wav")
    assert channel.rate == 25600.0
    assert channel.values == pytest.approx(samples / 2**23, abs=1e-12)


def test_a_rate_that_contradicts_the_file(tmp_path):
    wavfile.write(tmp_path / "a.wav", 25600, VALUES.astype(np.float32))
    with pytest.raises(CaseError, match="another one than --rate"):
        read_wav_signals(tmp_path / "a.wav", rate=48000.0)
