# %% [markdown]
# # From a film to a model
#
# A sheet of card is filmed while it swings after a push. How soft are its creases, and
# how much damping has it? A film with known answers is rendered here, so that they can
# be checked: of your own sheet, take a film with a phone on a tripod.

# %%
# %matplotlib inline
import tempfile
import warnings
from pathlib import Path

import numpy as np

import foldyn as fd
from foldyn import experiment as ex

folder = Path(tempfile.mkdtemp())
(folder / "swing.toml").write_text("""
model = { preset = "plate" }
supports = [
  { nodes = "xmax", axes = "x" },
  { nodes = [22], axes = "y" },
  { nodes = [21, 23], axes = "z" },
]
[pattern]
kind = "miura"
cells = [2, 2]
a = 0.025                   # m
b = 0.025
dihedral = 75               # degrees
[sheet]
youngs_modulus = 1.2e9      # Pa
poissons_ratio = 0.2
thickness = 2.4e-4          # m
density = 667               # kg/m3
length_scale_ratio = 2.7    # to be found: creases are softer the larger it is
[damping]
alpha = 14                  # 1/s, to be found
[[loads]]
nodes = "xmin"
force = [0.008, 0, 0]       # N on each
history = { kind = "half_sine", duration = 0.02 }
[analysis]
kind = "dynamics"
method = "generalized_alpha"
dt = 1e-3                   # s
duration = 0.18
[output]
interval = 1e-3
""")
case_file = fd.read_case(folder / "swing.toml")
motion = case_file.run()

# %% [markdown]
# ## The film
#
# The camera is 0.4 m away and sees 0.16 mm per pixel, at 240 frames per second and with
# the noise of a small sensor.

# %%
model = ex.TrackedModel.of(case_file.case())
low, high = model.rest.min(axis=0), model.rest.max(axis=0)
aim = [*(low + high)[:2] / 2, high[2]]
scale, distance = 1.6e-4, 0.4  # m per pixel, m
camera = ex.Camera.looking_at(aim, distance, metres_per_pixel=scale, size=(580, 620))
noisy = ex.Sensor(samples=4, read_noise=1.5, shot_noise=3.0)  # of 255 gray values
film = ex.film_of(motion, camera, rate=240, duration=0.17, sensor=noisy, seed=1)
ex.write_film(film, folder / "film.mkv")

# %% [markdown]
# ## Tracking
#
# Corners are followed, and recognized as nodes of the model.

# %%
how = ex.Tracking(placing=ex.Placing(metres_per_pixel=scale, distance=distance))
tracks = ex.track_film(str(folder / "film.mkv"), model, tracking=how)
fd.plots.draw_overlay(ex.open_film(folder / "film.mkv").picture(0), tracks)

# %%
nodes = [6, 8, 11, 13, 16]  # of the ridges next to the camera
seen = tracks.displacement.sel(node=nodes, axis="x").values
truth = film.truth().position.sel(node=nodes, axis="x").values - model.rest[nodes, 0]
noise = float(np.sqrt(np.nanmean((seen - truth) ** 2)))
print(f"tracks are off by {1e6 * noise:.0f} µm ({noise / scale:.2f} pixels)")
assert noise < 0.3 * scale
true = dict(zip(nodes, truth.T, strict=True))
fd.plots.plot_tracks(tracks, nodes[:2], axis="x", truth=true)

# %% [markdown]
# ## Fit
#
# From wrong guesses, the model's motion is fitted to the tracks. Foldyn warns if time
# steps are coarse beside the noise; film and model share theirs here, so that this
# error cancels.

# %%
warnings.simplefilter("ignore", fd.errors.FoldynWarning)
measured = {"nodes": nodes, "time": tracks.time.values, "values": seen}  # s, m
history = ex.TimeHistory(**measured, sigma=2.3e-5, sight=ex.Sight.of(tracks))
known = {"sheet.length_scale_ratio": 2.7, "damping.alpha": 14.0}
guessed = [ex.Parameter(key, 0.8 * value, 0.1, 50.0) for key, value in known.items()]
fit = fd.fit(folder / "swing.toml", [history], parameters=guessed)
print(fit.quality)
for key, value in known.items():
    one = fit[key]
    print(f"{key} {one.value:.3f} ({one.lower:.3f} to {one.upper:.3f}), truth {value}")
    assert abs(one.value / value - 1.0) < 0.02
