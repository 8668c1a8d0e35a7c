"""
What does my gear set sound like?
=================================

The lines at a microphone beside the ring become a WAV file: five seconds at constant speed, in pascal, with
the full scale in the file. The picture is the sound over one turn of the carrier.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case, solve, with_values
from femgear.exchange.formats import Signal, write_wav
from femgear.housing.sound import sampled_signal, stored_sound, whole_turns

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml")
case = with_values(case, {"static.positions": 16, "static.stresses": False, "runup.count": 0})
lines, pressure = stored_sound(solve(case, "housing")["housing"].dataset().isel(speed=1))

# %%
# Whole turns of the carrier, so that a player can repeat the file without a click.

rate, speed = 48000, abs(float(lines.carrier_speed))
sound = sampled_signal(lines.order, pressure, speed, samples=whole_turns(speed, 5.0, rate=rate), rate=rate)
path = Path(tempfile.gettempdir()) / "gear_set.wav"
write_wav(Signal("microphone", "Pa", rate, sound), path, full_scale=1.05 * np.abs(sound).max())
print(f"{len(sound) / rate:.2f} s, {20 * np.log10(sound.std() / 20e-6):.1f} dB, written to {path.name}")

turn = round(2 * np.pi / speed * rate)
figure, ax = plt.subplots(layout="constrained")
ax.plot(np.arange(turn) / rate, sound[:turn], linewidth=0.5)
ax.set(xlabel="time [s]", ylabel="sound pressure [Pa]")
plt.show()
