"""examples/camera runs as its help says: on a simulated tracker, and on the files of one."""

import subprocess
import sys
from pathlib import Path

import sila
from PIL import Image

SCRIPT = Path(__file__).parents[2] / "examples" / "camera" / "predict_on_video.py"


def run(folder, *arguments):
    command = [sys.executable, str(SCRIPT), *map(str, arguments)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_weighted_paths_are_drawn_on_the_frames(tmp_path):
    done = run(tmp_path, "--out", "drawn", "--every", "100")
    assert done.returncode == 0, done.stderr
    assert "predictions" in done.stdout and done.stdout.strip().endswith("{}"), "nothing is rejected"
    colours = [len(Image.open(path).getcolors(1 << 20)) for path in sorted((tmp_path / "drawn").glob("*.png"))]
    assert len(colours) > 5 and max(colours) > 10
    # The first minute of what it wrote, given back as the files of a tracker, with pictures of half of the frames.
    camera, tracks = tmp_path / "drawn" / "camera.json", tmp_path / "drawn" / "tracks.txt"
    lines = [line for line in tracks.read_text().splitlines() if int(line.split(",")[0]) <= 600]
    tracks.write_text("\n".join(lines))
    (tmp_path / "img1").mkdir()
    for number in range(1, 301):
        Image.new("RGB", (64, 36), "#787878").save(tmp_path / "img1" / f"{number:06d}.png")
    given = [tracks, "--camera", camera, "--fps", "10", "--frames", "img1", "--model", "m.sila"]
    done = run(tmp_path, *given, "--out", "again", "--every", "300")
    assert done.returncode == 0, done.stderr
    first, second = (Image.open(tmp_path / "again" / name) for name in ("000300.png", "000600.png"))
    assert first.getpixel((0, 0)) == (120, 120, 120) and second.getpixel((0, 0)) == (0, 0, 0)
    learnt = sila.read_tracks(tracks, frames_per_second=10, camera=camera)
    assert learnt.report["rows_read"] == len(lines), "sila reads the same file"
    assert sila.Model.load(tmp_path / "m.sila").tracks == len(learnt)


def test_wrong_use_is_one_sentence(tmp_path):
    (tmp_path / "t.txt").write_text("1,1,0,0,10,20,1,-1,-1,-1\n")
    (tmp_path / "empty.txt").write_text("\n")
    (tmp_path / "c.json").write_text('{"homography": [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 1]]}')
    camera = ("--camera", "c.json")
    for arguments, words in (
        (["t.txt"], "--camera"),
        (["none.txt", *camera], "none.txt"),
        (["empty.txt", *camera], "empty.txt: expected lines of MOTChallenge, found none"),
        (["t.txt", "--camera", "none.json"], "none.json"),
        (["t.txt", *camera, "--fps", "0"], "--fps"),
        (["t.txt", *camera, "--every", "0"], "--every"),
    ):
        done = run(tmp_path, *arguments)
        assert done.returncode == 2 and words in done.stderr and len(done.stderr.splitlines()) == 1, done.stderr
