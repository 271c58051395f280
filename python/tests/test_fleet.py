"""A fleet gives one model, whoever does the work and whatever happens to them."""

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
import sila
import sila.fleet
from distributed import Client, LocalCluster
from sila import _fleet_program
from sila._program import PROGRAM

PARTITION = 20


@pytest.fixture(scope="session")
def client():
    with sila.fleet.local_client(2) as client:
        yield client


@pytest.fixture(scope="session")
def sites(tmp_path_factory):
    """Two intersections of different widths, three files of tracks each, the scene beside them."""
    folder = tmp_path_factory.mktemp("sites")
    for site, layout, width in ((1, "four-way", 2.0), (2, "acute", 3.0)):
        (folder / str(site)).mkdir()
        for day in range(3):
            made = sila.simulate(layout=layout, sidewalk_width_m=width, tracks=30, seed=10 * site + day)
            made.reported.save(folder / str(site) / f"day{day}.csv")
        made.scene.save(folder / str(site) / "scene.json")
    return folder


@pytest.fixture(scope="session")
def outcome(client, sites):
    return sila.fleet.learn(sites, client=client, batch=10, partition=PARTITION)


def saved(model, tmp_path, name):
    model.save(tmp_path / name)
    return (tmp_path / name).read_bytes()


def tracks_at(sites, site):
    folder = sites / str(site)
    return sum(len(sila.read_tracks(file, scene=folder / "scene.json")) for file in folder.glob("*.csv"))


def test_every_track_of_every_source_is_learnt(outcome, sites):
    files = sorted(sites.rglob("*.csv"))
    tracks = sum(len(sila.read_tracks(file, scene=file.parent / "scene.json")) for file in files)
    assert outcome.model.tracks == outcome.tracks == tracks
    assert outcome.sources == 6
    assert outcome.partitions == sum(
        -(-len(sila.read_tracks(file, scene=file.parent / "scene.json")) // PARTITION) for file in files
    )
    assert outcome.unread == {}
    assert len(outcome.model.episode_ids) == outcome.model.episodes
    assert {site.tracks for site in outcome.model.sites} == {tracks_at(sites, 1), tracks_at(sites, 2)}
    assert len(outcome.model.history) == 1


def test_one_worker_and_another_order_give_the_same_bytes(outcome, sites, tmp_path):
    files = sorted(sites.rglob("*.csv"), reverse=True)
    local = {"processes": False, "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(n_workers=1, threads_per_worker=2, **local) as cluster, Client(cluster) as single:
        alone = sila.fleet.learn(files, client=single, batch=10, partition=PARTITION)
    assert alone.model == outcome.model
    assert saved(alone.model, tmp_path, "a.sila") == saved(outcome.model, tmp_path, "b.sila")


def test_a_worker_that_is_killed_changes_nothing(outcome, sites):
    with sila.fleet.local_client(2) as client:
        workers = client.run(os.getpid)
        done = threading.Event()

        def kill_one():
            # In the middle: some partitions are learnt, the tree is not.
            while not done.is_set():
                pending = client.run_on_scheduler(
                    lambda dask_scheduler: [
                        str(key)
                        for key, task in dask_scheduler.tasks.items()
                        if task.state in ("waiting", "queued", "processing", "no-worker")
                    ]
                )
                learning = sum("-learn-" in key for key in pending)
                if any("-finalise-" in key for key in pending) and learning <= outcome.partitions - 2:
                    os.kill(next(iter(workers.values())), signal.SIGKILL)
                    return True
                time.sleep(0.005)
            return False

        with ThreadPoolExecutor() as pool:
            killed = pool.submit(kill_one)
            again = sila.fleet.learn(sites, client=client, batch=10, partition=PARTITION)
            done.set()
            assert killed.result(), "the worker was killed before the end"
        assert set(client.run(os.getpid).values()) != set(workers.values())
    assert again.model == outcome.model


def test_running_it_again_learns_nothing_twice(client, outcome, sites):
    again = sila.fleet.learn(sites, client=client, model=outcome.model, batch=10, partition=PARTITION)
    assert again.tracks == again.partitions == 0
    assert again.known_episodes == outcome.model.episodes
    assert again.model == outcome.model


def test_it_goes_on_with_what_is_new(client, outcome, sites, tmp_path):
    (tmp_path / "scene.json").write_bytes((sites / "1" / "scene.json").read_bytes())
    made = sila.simulate(layout="four-way", sidewalk_width_m=2.0, tracks=30, seed=99)
    made.reported.save(tmp_path / "tomorrow.csv")
    more = sila.fleet.learn([sites, tmp_path], client=client, model=outcome.model, batch=10, partition=PARTITION)
    assert more.known_episodes == outcome.model.episodes
    assert more.model.tracks == outcome.model.tracks + more.tracks
    assert set(outcome.model.episode_ids) < set(more.model.episode_ids)
    only_new = sila.fleet.learn(tmp_path, client=client, model=outcome.model, batch=10, partition=PARTITION)
    assert only_new.model == more.model


def test_models_that_were_learnt_elsewhere_are_sources_too(client, outcome, sites, tmp_path):
    made = sila.simulate(layout="obtuse", tracks=30, seed=5)
    sila.learn(made.tracks, scene=made.scene).save(tmp_path / "elsewhere.sila")
    both = sila.fleet.learn([sites, tmp_path], client=client, batch=10, partition=PARTITION)
    assert both.model.tracks == outcome.model.tracks + len(made.tracks)
    alone = sila.fleet.learn(tmp_path / "elsewhere.sila", client=client)
    assert alone.model == sila.Model.load(tmp_path / "elsewhere.sila")


def test_an_unreadable_source_is_reported_and_ends_the_run_only_if_it_should(client, outcome, sites, tmp_path):
    (tmp_path / "scene.json").write_bytes((sites / "1" / "scene.json").read_bytes())
    (tmp_path / "broken.csv").write_text("track_id,t,x,y\n1,0.0,one,2\n")
    sources = [sites, tmp_path / "broken.csv", tmp_path / "absent.csv"]
    outcome_ = sila.fleet.learn(sources, client=client, batch=10, partition=PARTITION)
    assert outcome_.model == outcome.model
    assert set(outcome_.unread) == {str(tmp_path / "broken.csv"), str(tmp_path / "absent.csv")}
    assert outcome_.unread[str(tmp_path / "absent.csv")] == "no such file or folder"
    with pytest.raises(sila.FormatError, match="2 of 8 cannot"):
        sila.fleet.learn(sources, client=client, batch=10, partition=PARTITION, strict=True)


def test_a_damaged_model_is_left_out_and_named(client, outcome, sites, tmp_path):
    damaged = tmp_path / "damaged.sila"
    damaged.write_bytes(saved(outcome.model, tmp_path, "whole.sila")[:5000])
    (tmp_path / "whole.sila").unlink()
    rest = sila.fleet.learn([sites, tmp_path], client=client, batch=10, partition=PARTITION)
    assert rest.model == outcome.model
    assert list(rest.unread) == [str(damaged)]
    with pytest.raises(sila.FormatError, match="damaged.sila: expected a source that can be read"):
        sila.fleet.learn([sites, tmp_path], client=client, batch=10, partition=PARTITION, strict=True)


def test_hidden_files_and_folders_are_no_sources(client, sites, tmp_path):
    track_file = (sites / "1" / "day0.csv").read_bytes()
    for name in ("day0.csv", ".day0.csv", ".ipynb_checkpoints/day0-checkpoint.csv", ".cache/1/day0.csv"):
        (tmp_path / ".run" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / ".run" / name).write_bytes(track_file)
    found = sila.fleet.learn(tmp_path / ".run", client=client, batch=10, partition=PARTITION)
    assert found.sources == 1, "the folder that was named counts, hidden or not"


def test_files_without_tracks_are_left_out_and_named(client, model, sites, tmp_path):
    (tmp_path / "README.md").write_text("hello\n")
    (tmp_path / "camera.json").write_text('{"image_points": []}')
    found = sila.fleet.learn([sites / "1" / "day0.csv", tmp_path], client=client)
    assert set(found.unread) == {str(tmp_path / "README.md"), str(tmp_path / "camera.json")}
    assert "expected tracks in a known format" in found.unread[str(tmp_path / "camera.json")]
    assert found.tracks > 0
    model.save(tmp_path / "elsewhere.sila")
    models = sila.fleet.learn(tmp_path, client=client)
    assert (set(models.unread), models.model) == (set(found.unread), model)


class NoClient:
    """Work that is rejected before it starts needs no cluster."""

    def submit(self, *_, **__):
        raise AssertionError("work was started")


def test_a_source_without_a_scene_is_rejected_before_any_work(sites, tmp_path):
    (tmp_path / "lonely.csv").write_bytes((sites / "1" / "day0.csv").read_bytes())
    with pytest.raises(sila.FormatError, match=r"lonely.csv: expected a scene, given or beside it"):
        sila.fleet.learn([sites, tmp_path], client=NoClient())
    (tmp_path / "lonely.csv").write_text("frame,track_id,x,y\n1,1,2,3\n2,1,2,3\n")
    with pytest.raises(sila.FormatError, match=r"lonely.csv: expected a scene, given or beside it"):
        sila.fleet.learn([sites, tmp_path], client=NoClient())
    (tmp_path / "lonely.scene.json").write_text('{"origin": [0, 0]}')
    with pytest.raises(sila.FormatError, match="lonely.scene.json"):
        sila.fleet.learn([sites, tmp_path], client=NoClient())


def test_sources_without_any_scene_are_one_place(client, sites, tmp_path):
    for day in range(2):
        (tmp_path / f"day{day}.csv").write_bytes((sites / "1" / f"day{day}.csv").read_bytes())
    model = sila.fleet.learn(tmp_path, client=client, batch=10, partition=PARTITION).model
    assert len(model.sites) == 1
    files = [tmp_path / "day1.csv", tmp_path / "day0.csv"]
    assert sila.fleet.learn(files, client=client, batch=10, partition=PARTITION).model == model
    (tmp_path / "day2.csv").write_bytes((sites / "1" / "day2.csv").read_bytes())
    further = sila.fleet.learn(tmp_path / "day2.csv", model=model, client=client, batch=10, partition=PARTITION).model
    assert len(further.sites) == 1
    assert further.tracks > model.tracks
    with pytest.raises(ValueError, match="leave the scene out"):
        sila.fleet.learn(tmp_path, scene=sites / "1" / "scene.json", model=model, client=NoClient())


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"scaling": "metres", "reference_width_m": 0.0}, "scaling"),
        ({"reference_width_m": 2.9}, "reference_width_m"),
        ({"learn": {"grid": {"cell_m": 2.2}}}, "cell_m"),
        ({"sampling": {"interval_s": 0.1}}, "interval_s"),
        ({"predict": {"horizon_s": 4.0}}, "horizon_s"),
        ({"metres_per_pixel": 0.5}, "metres_per_pixel"),
    ],
)
def test_models_of_another_grid_are_rejected_before_any_work(sites, tmp_path, changes, named):
    made = sila.simulate(tracks=20, seed=5)
    by_width = {"scaling": "mean_width", "reference_width_m": 2.0}
    sila.learn(made.tracks, scene=made.scene, config=by_width | changes).save(tmp_path / "other.sila")
    with pytest.raises(sila.FormatError, match=rf"other.sila: .*{named}"):
        sila.fleet.learn([sites, tmp_path], client=NoClient(), config=by_width)


def test_models_of_another_schema_are_rejected_before_any_work(sites, model, tmp_path):
    import sqlite3

    model.save(tmp_path / "old.sila")
    with sqlite3.connect(tmp_path / "old.sila") as database:
        database.execute("PRAGMA user_version = 1")
    database.close()
    with pytest.raises(sila.FormatError, match="schema 1 of an older sila"):
        sila.fleet.learn([sites, tmp_path], client=NoClient())


def test_priors_and_empty_models_are_no_sources(client, model, sites, tmp_path):
    path, tracks = tmp_path / "first.sila", sites / "1" / "day0.csv"
    for first, named in ((sila.make_prior([model]), "a prior"), (sila.Model(), "an empty model")):
        first.save(path)
        with pytest.raises(sila.FormatError, match=rf"first.sila: .*found {named}; give it as --model .*model="):
            sila.fleet.learn([tracks, path], client=NoClient())
    prior = sila.make_prior([model])
    prior.save(path)
    continued = sila.fleet.learn([tracks, path], model=prior, client=client)
    assert continued.model == sila.fleet.learn(tracks, model=prior, client=client).model


def test_arguments_are_checked(sites):
    with pytest.raises(ValueError, match="partition: expected a whole number"):
        sila.fleet.learn(sites, client=NoClient(), partition=0)
    with pytest.raises(ValueError, match="sources: expected at least one path"):
        sila.fleet.learn([], client=NoClient())
    with pytest.raises(TypeError, match="model: expected a sila.Model"):
        sila.fleet.learn(sites, client=NoClient(), model="m.sila")
    for sources, found in (([3], "3"), (b"a.csv", "b'a.csv'"), (3, "3"), (None, "None")):
        with pytest.raises(TypeError, match=f"learn: sources: expected the path of a file, found {found}"):
            sila.fleet.learn(sources, client=NoClient())
    for sources in ("", [""], {"": None}):
        with pytest.raises(ValueError, match="learn: sources: expected a path, found ''"):
            sila.fleet.learn(sources, client=NoClient())
    for sources, scene in ((sites, 3), ({sites / "1": 3}, None)):
        with pytest.raises(TypeError, match="scene: expected a sila.Scene or the path of a scene file, found int"):
            sila.fleet.learn(sources, scene=scene, client=NoClient())
    with pytest.raises(TypeError, match="client: expected a dask.distributed.Client, found 3"):
        sila.fleet.learn(sites, client=3)
    with pytest.raises(TypeError, match="strict: expected True or False, found 'no'"):
        sila.fleet.learn(sites, client=NoClient(), strict="no")


def test_error_statistics_travel_bit_for_bit(place):
    settings = sila._sila.merged_config("{}", "{}", "config")
    tracks = list(place.tracks)
    error_statistics = sila._sila.run_task("calibrate", tracks, place.scene, 20, [], [None, None], settings, 1)
    assert pickle.dumps(pickle.loads(pickle.dumps(error_statistics))) == pickle.dumps(error_statistics)


def program(*arguments):
    command = [sys.executable, "-c", "from sila._program import main; main()", "fleet", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)


def test_the_program_learns_a_fleet(outcome, sites, tmp_path):
    run = program(sites, "--model", tmp_path / "city.sila", "--batch", 10, "--partition", PARTITION, "--workers", 2)
    assert run.returncode == 0, run.stderr
    assert f"{outcome.tracks} new tracks" in run.stdout
    assert run.stderr == "", "nothing of distributed is logged, at the end either"
    assert sila.Model.load(tmp_path / "city.sila") == outcome.model
    again = program(sites, "--model", tmp_path / "city.sila", "--batch", 10, "--partition", PARTITION, "--workers", 1, "--json")
    assert again.returncode == 0, again.stderr
    assert '"tracks": 0' in again.stdout


def test_the_program_tells_bad_input_from_wrong_use(sites, tmp_path):
    (tmp_path / "lonely.csv").write_text("track_id,t,x,y\n")
    bad = program(tmp_path / "lonely.csv", "--model", tmp_path / "m.sila", "--workers", 1)
    assert bad.returncode == 1
    assert "lonely.csv: expected at least one usable row" in bad.stderr
    assert not (tmp_path / "m.sila").exists()
    assert program(sites).returncode == 2
    wrong = program(sites, "--model", tmp_path / "m.sila", "--workers", 1, "--set", "fuse.similarity_threshold=7")
    assert (wrong.returncode, "similarity_threshold" in wrong.stderr) == (2, True)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ([""], "expected a value, found an empty one"),
        (["sites", "--batch", "x"], "argument --batch: expected a whole number of at least 1, found x"),
        (["sites", "--batch", "0"], "argument --batch: expected a whole number of at least 1, found 0"),
    ],
)
def test_the_program_names_a_wrong_argument(arguments, named, capsys):
    with pytest.raises(SystemExit, match="2"):
        _fleet_program.run([*arguments, "--model", "m.sila"])
    assert named in capsys.readouterr().err


def test_the_program_prints_each_warning_as_one_line(sites, tmp_path):
    for day in range(2):
        frame = sila.read_tracks(sites / "1" / f"day{day}.csv").to_frame()
        frame[["x", "y"]] = 50 * frame[["x", "y"]] + 500
        frame.to_csv(tmp_path / f"pixels{day}.csv", index=False)
    run = program(tmp_path, "--model", tmp_path / "m.sila", "--workers", 1)
    assert run.returncode == 0, run.stderr
    lines = run.stderr.splitlines()
    assert len(lines) == 2
    for day, line in enumerate(lines):
        assert line.startswith(f"warning: {tmp_path / f'pixels{day}.csv'}: these look like pixels")
        assert "the scene file: `files[i].frames_per_second`, `files[i].metres_per_unit`" in line


def test_a_model_that_does_not_fit_is_no_wrong_use(outcome, sites, tmp_path):
    outcome.model.save(tmp_path / "city.sila")
    other_grid = ["--set", "learn.grid.cell_m=2.2"]
    unfit = program(sites, "--model", tmp_path / "city.sila", "--workers", 1, *other_grid)
    assert (unfit.returncode, "cell_m" in unfit.stderr, unfit.stderr.count("\n")) == (1, True, 1), unfit.stderr


def test_a_model_file_that_changed_meanwhile_is_kept(client, outcome, sites, tmp_path, monkeypatch, capsys):
    path, learn = tmp_path / "city.sila", sila.fleet.learn

    def slowly(*sources, **options):
        outcome.model.save(path)
        return learn(*sources, **options)

    monkeypatch.setattr(sila.fleet, "learn", slowly)
    monkeypatch.setattr(_fleet_program, "_client", lambda _: contextlib.nullcontext(client))
    assert _fleet_program.run([str(sites / "1" / "day0.csv"), "--model", str(path)]) == 1
    assert "city.sila has changed since this run began; nothing was written" in capsys.readouterr().err
    assert sila.Model.load(path) == outcome.model


def test_an_interrupt_of_the_program_is_one_line(sites, tmp_path):
    """As Ctrl-C: the workers get the signal, too."""
    begun = (
        "import os, signal, sila.fleet, sila._fleet_program as program\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # ignored in a job in the background of a shell
        "def interrupted(*sources, client, **options):\n"
        "    learnt = client.submit(__import__('time').sleep, 60)\n"
        "    os.killpg(0, signal.SIGINT)\n"
        "    client.gather([learnt])\n"
        "sila.fleet.learn = interrupted\n"
        f"raise SystemExit(program.run([{str(sites)!r}, '--model', {str(tmp_path / 'm.sila')!r}, '--workers', '2']))"
    )
    command = [sys.executable, "-c", begun]
    run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300, start_new_session=True)
    assert (run.returncode, run.stderr) == (130, "sila: interrupted; nothing was written\n")
    assert not (tmp_path / "m.sila").exists()


def test_the_plain_program_says_where_the_fleet_is():
    run = subprocess.run([PROGRAM, "fleet", "sites", "--model", "m"], capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert "pip install" in run.stderr
