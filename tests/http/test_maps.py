"""Maps of stations over HTTP: what a dataset says of them, maps=on|off in views, picks, and batches, what is kept under
which ETag, and a memory limit that has no room for them. The wall's map has other colours than its
splats, and its station saw through it from y = 0.5 on (make_wall.c)."""
import pathlib

from harness import FAKE, MAPPED, WALL, Daemon, run

NAME = pathlib.Path(MAPPED).stem


def test_a_dataset_says_what_maps_it_has():
    with Daemon(FAKE, datasets=[MAPPED, WALL]) as d:
        maps = d.ask(f"/v1/datasets/{NAME}").json()["maps"]
        assert maps["stations"] == 1 and maps["texels"] == 6 * 512 * 512 and maps["methods"] == ["splat", "nearest"], maps
        assert maps["bytes"] / maps["texels"] < 3, maps  # ranges as many as colours: 2 bytes a texel and 0.68
        assert d.ask("/v1/datasets/wall").json()["maps"] is None
        table = {p["name"]: p for p in d.ask("/v1/methods").json()["parameters"]}
        assert [name for name, p in table.items() if p["maps"]] == ["maps"]
        assert table["maps"]["enum"] == ["on", "off"] and table["maps"]["default"] == "on"


def test_what_changes_nothing_makes_no_other_etag():
    with Daemon(FAKE, datasets=[MAPPED, WALL]) as d:
        def tag(name, query):
            return d.ask(f"/v1/datasets/{name}/view?{query}", "HEAD").headers["ETag"]
        for query in "", "layer=depth", "layers=color,id", "method=nearest":
            assert tag("wall", query + "&maps=off") == tag("wall", query) == tag("wall", query + "&maps=on"), query
            assert tag(NAME, query + "&maps=off") != tag(NAME, query) == tag(NAME, query + "&maps=on"), query
        assert tag(NAME, "method=points&maps=off") == tag(NAME, "method=points")


def test_what_maps_may_be():
    with Daemon(FAKE) as d:
        for value in "yes", "ON", "1", "", "true":
            reply = d.view(maps=value)
            assert reply.status == 400 and reply.json()["field"] == "maps" and "on, off" in reply.json()["detail"], value
        for value in True, 1, None, "none":
            reply = d.post({"maps": value})
            assert reply.status == 400 and reply.json()["field"] == "maps", reply.body
        assert d.ask("/v1/datasets/wall/pick?x=1&y=1&maps=no").json()["field"] == "maps"


run(globals())
