"""
Which tolerances does load sharing need?
========================================

Three hundred gear sets with a sun that is held are drawn from tolerances of the pins, and the contact of
each is solved. The distribution of the load sharing factor tells what a class of tolerances is worth.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case
from femgear.study.samples import prepared, sample_block

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml")
figure, ax = plt.subplots(layout="constrained")
law = 'pin_errors.tangential = { distribution = "normal", sigma = "%s um" }\n'

# %%
# The factor is the largest share of a planet over the mean of the three.

for sigma, style in (("1.5", "-"), ("3", "--"), ("6", "-.")):
    with tempfile.TemporaryDirectory() as folder:
        (file := Path(folder) / "tolerances.toml").write_text(law % sigma)
        model, _ = prepared(case, file, positions=8)
    factor = np.sort(3 * sample_block(model, seed=1, first=0, count=300)["largest_share"])
    ax.plot(factor, np.linspace(0, 100, len(factor)), style, label=f"pins within σ = {sigma} µm")
    print(f"sigma {sigma} um: 95 % of the sets below {np.quantile(factor, 0.95):.2f}")

ax.set(xlabel="load sharing factor K_γ [1]", ylabel="sets below it [%]")
ax.legend()
plt.show()
