"""Stands in for the video of predict_on_video.py: the files of a tracker that looks at a simulated intersection."""

import json
from pathlib import Path

import numpy as np
import sila


def simulated(folder: Path) -> tuple[Path, Path]:
    """A MOT file at 10 frames a second and a camera file."""
    tracks = sila.simulate(tracks=60, seed=1).reported.to_frame()
    (left, near), (right, far) = tracks[["x", "y"]].min(), tracks[["x", "y"]].max()
    ground = [[left, near], [right, near], [right, far], [left, far]]
    camera = {"image_points": [[40, 700], [1240, 700], [900, 150], [380, 150]], "ground_points": ground}
    (folder / "camera.json").write_text(json.dumps(camera))
    feet = sila.Stream(camera=folder / "camera.json").to_image(tracks[["x", "y"]])
    frames = np.round((tracks["t"] - tracks["t"].min()) * 10).astype(int) + 1
    rows = sorted(zip(frames, tracks["track_id"].factorize()[0] + 1, feet[:, 0] - 10, feet[:, 1] - 50))
    (folder / "tracks.txt").write_text("".join(f"{f},{i},{x:.2f},{y:.2f},20,50,1,-1,-1,-1\n" for f, i, x, y in rows))
    return folder / "tracks.txt", folder / "camera.json"
